//! A route whose joints stay within their limits however often they turn, and that closes where the path does.

use super::closed::closed_route;
use super::graph::{Blockage, Graph, Search};
use super::turns::{unwind, within_limits};
use crate::robot::Limits;

/// A route as postures.
#[derive(Debug, Clone)]
pub struct FoundRoute {
    /// Postures of the layers that were reached, n a row, whole turns included.
    pub q: Vec<f64>,
    /// Cells of the graph as given.
    pub cells: Vec<usize>,
    /// Worst value or integral.
    pub cost: f64,
    /// What keeps the next layer from being reached, unless it has no open cell or no branch leads on.
    pub blockage: Option<Blockage>,
}

impl FoundRoute {
    fn none() -> Self {
        Self { q: Vec::new(), cells: Vec::new(), cost: f64::INFINITY, blockage: None }
    }
}

/// The best route from the first layer on, through all layers or as far as there is a way. Whole turns are left out of the search at first:
/// only joints whose best path does not fit within their limits are searched with them.
pub fn find_route(graph: &Graph, search: &Search, limits: Option<&Limits>, closed: bool) -> FoundRoute {
    let mut graph = std::borrow::Cow::Borrowed(graph);
    let copies = graph.copies;
    loop {
        let route = if closed { closed_route(&graph, search) } else { graph.route(search, 0, None) };
        let reached = route.cells.len();
        if reached == 0 {
            return FoundRoute::none();
        }
        let n = graph.n;
        let mut q: Vec<f64> = route.cells.iter().enumerate().flat_map(|(layer, &cell)| graph.posture(layer, cell)).copied().collect();
        unwind(&mut q, n, &graph.wide);
        let blockage = (reached < graph.layers()).then(|| graph.blockage(search, reached, &route.frontier)).flatten();
        // Without limits nothing holds a joint near 0 but this.
        let fitted = within_limits(&mut q, n, &graph.wide, limits.unwrap_or(&Limits::none(n)));
        match (fitted, limits) {
            (Err(joint), Some(limits)) => {
                graph = std::borrow::Cow::Owned(graph.with_turns(joint, limits.q_min[joint], limits.q_max[joint]));
            }
            _ => {
                let copies = graph.copies / copies;
                let cells = route.cells.iter().map(|cell| cell / copies).collect();
                return FoundRoute { q, cells, cost: route.cost, blockage };
            }
        }
    }
}
