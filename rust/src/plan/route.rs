//! Routes whose joints stay within their limits however often they turn, and that close where the path does.

use std::borrow::Cow;
use std::f64::consts::TAU;

use super::closed::ClosedRoutes;
use super::graph::{Blockage, Criterion, Graph, Route, Search};
use super::turns::{through, unwind, within_limits};
use super::ways::{spread, ways};
use crate::robot::Limits;

/// Weight of the motion beside which values do not count.
const CALM: f64 = 1e6;

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

/// The best routes through a graph, for one slack or another: what does not hang on the slack is searched once. Whole turns are left out of the
/// search at first: only joints whose best path does not fit within their limits are searched with them.
#[derive(Debug)]
pub(super) struct RouteFinder<'a> {
    search: Search,
    limits: Option<&'a Limits>,
    closed: bool,
    /// Layers and the postures that are held there, whole turns included.
    held: Vec<(usize, &'a [f64])>,
    /// The graph as given, and with the turns of some joints.
    graphs: Vec<Searched<'a>>,
}

/// A graph, and what is known of its routes whatever the slack.
#[derive(Debug)]
struct Searched<'a> {
    graph: Cow<'a, Graph>,
    /// From which graph it came by which joint's turns.
    from: Option<(usize, usize)>,
    best: Option<Route>,
    closed: ClosedRoutes,
}

impl<'a> Searched<'a> {
    fn new(graph: Cow<'a, Graph>, from: Option<(usize, usize)>) -> Self {
        Self { graph, from, best: None, closed: ClosedRoutes::default() }
    }

    fn route(&mut self, search: &Search, closed: bool) -> Route {
        let best = self.best.get_or_insert_with(|| self.graph.sweep(search, None, None));
        let open = self.graph.smoothed(search, best);
        if closed { self.closed.route(&self.graph, search, open) } else { open }
    }
}

impl<'a> RouteFinder<'a> {
    /// For one graph and one way to search it.
    pub fn new(graph: impl Into<Cow<'a, Graph>>, search: Search, limits: Option<&'a Limits>, closed: bool) -> Self {
        Self { search, limits, closed, held: Vec::new(), graphs: vec![Searched::new(graph.into(), None)] }
    }

    /// The same with postures held at some layers.
    pub fn holding(mut self, held: Vec<(usize, &'a [f64])>) -> Self {
        if !held.is_empty() {
            let graph = self.graphs[0].graph.to_mut();
            held.iter().for_each(|(layer, q)| graph.hold(*layer, q));
        }
        Self { held, ..self }
    }

    /// How many steps from cell to cell a sweep looks at, at most.
    pub fn steps(&self) -> usize {
        self.graphs[0].graph.steps_of_sweep(&self.search)
    }

    /// The best route for a slack, through all layers or as far as there is a way.
    pub fn find(&mut self, slack: f64) -> FoundRoute {
        let search = Search { slack, ..self.search };
        let mut at = 0;
        loop {
            let route = self.graphs[at].route(&search, self.closed);
            let graph = &self.graphs[at].graph;
            let (n, reached) = (graph.n, route.cells.len());
            if reached == 0 {
                return FoundRoute { q: Vec::new(), cells: Vec::new(), cost: f64::INFINITY, blockage: None };
            }
            let mut q = graph.postures(&route.cells);
            unwind(&mut q, n, &graph.wide);
            let blockage = (reached < graph.layers()).then(|| graph.blockage(&search, reached, &route.frontier)).flatten();
            let held: Vec<(usize, &[f64])> = self.held.iter().filter(|(layer, _)| *layer < reached).copied().collect();
            // Without limits nothing holds a joint near 0 but this.
            let free = Limits::none(n);
            let limits = self.limits.unwrap_or(&free);
            let fitted = if held.is_empty() {
                within_limits(&mut q, n, &graph.wide, limits)
            } else {
                through(&mut q, n, &graph.wide, limits, &held)
            };
            match fitted {
                Err(joint) if self.limits.is_some() || !held.is_empty() => at = self.turned(at, joint),
                _ => {
                    let copies = graph.copies / self.graphs[0].graph.copies;
                    let cells = route.cells.iter().map(|cell| cell / copies).collect();
                    return FoundRoute { q, cells, cost: route.cost, blockage };
                }
            }
        }
    }

    /// The best route of every way through all layers, `most` at most, the cheapest first; each fits within limits, and closes where the path does.
    pub fn ways(&self, most: usize) -> Vec<FoundRoute> {
        self.fitting(&self.search, |graph, search| ways(graph, search, most))
    }

    /// Routes of little motion, whatever the values: at `spins` spins of every branch.
    pub fn calm(&self, spins: usize) -> Vec<FoundRoute> {
        let search = Search { criterion: Criterion::Integral, smoothness: CALM, ..self.search };
        self.fitting(&search, |graph, search| spread(graph, search, spins))
    }

    /// The best routes through `spins` spins of every branch.
    pub fn spread(&self, spins: usize) -> Vec<FoundRoute> {
        self.fitting(&self.search, |graph, search| spread(graph, search, spins))
    }

    /// Those of some routes that fit within limits, and close where the path does.
    fn fitting(&self, search: &Search, routes: impl Fn(&Graph, &Search) -> Vec<Route>) -> Vec<FoundRoute> {
        let graph = &self.graphs[0].graph;
        let last = graph.layers() - 1;
        let closing = |route: Route| {
            let mut ends = vec![false; graph.cells()];
            let seam = graph.seam(route.cells[0]);
            ends[seam * graph.copies..(seam + 1) * graph.copies].fill(true);
            let route = graph.sweep(search, Some(&ends), None);
            (route.cells.len() > last && route.cost.is_finite()).then_some(route)
        };
        let routes = routes(graph, search).into_iter().filter_map(|route| if self.closed { closing(route) } else { Some(route) });
        routes
            .filter_map(|route| {
                let mut q = graph.postures(&route.cells);
                unwind(&mut q, graph.n, &graph.wide);
                let fitted = within_limits(&mut q, graph.n, &graph.wide, self.limits.unwrap_or(&Limits::none(graph.n)));
                (fitted.is_ok() || self.limits.is_none()).then_some(FoundRoute { q, cells: route.cells, cost: route.cost, blockage: None })
            })
            .collect()
    }

    /// A graph with the turns of one joint more.
    fn turned(&mut self, from: usize, joint: usize) -> usize {
        self.graphs.iter().position(|known| known.from == Some((from, joint))).unwrap_or_else(|| {
            let held = self.held.iter().map(|(_, q)| q[joint]);
            let (low, high) = match self.limits {
                Some(limits) => (limits.q_min[joint], limits.q_max[joint]),
                // A turn to either side of what is held is enough.
                None => held.fold((0.0, 0.0), |(low, high): (f64, f64), x| (low.min(x - TAU), high.max(x + TAU))),
            };
            let mut graph = self.graphs[from].graph.with_turns(joint, low, high);
            self.held.iter().for_each(|(layer, q)| graph.hold(*layer, q));
            self.graphs.push(Searched::new(Cow::Owned(graph), Some((from, joint))));
            self.graphs.len() - 1
        })
    }
}

impl From<Graph> for Cow<'_, Graph> {
    fn from(graph: Graph) -> Self {
        Cow::Owned(graph)
    }
}

impl<'a> From<&'a Graph> for Cow<'a, Graph> {
    fn from(graph: &'a Graph) -> Self {
        Cow::Borrowed(graph)
    }
}

/// The best route through a graph, through all layers or as far as there is a way.
pub fn find_route(graph: &Graph, search: &Search, limits: Option<&Limits>, closed: bool) -> FoundRoute {
    RouteFinder::new(graph, *search, limits, closed).find(search.slack)
}
