//! Routes that end in the posture they start from, up to whole turns, by branch and bound over sets of postures (Land and Doig 1960).

use super::graph::{Criterion, Graph, Route, Search};

/// Searches over sets of postures before the best that was found has to do, and the steps that all of them may look at.
const MAX_SEARCHES: usize = 48;
const MAX_STEPS: usize = 400_000_000;
/// Of how many searches one has its ends tried as seams.
const TRIED: usize = 4;
/// A bound this near to the best route, relative, leaves nothing to be found.
const CLOSE: f64 = 1e-9;

/// Postures at which a route may start and end, in order of branch, and what no route among them costs less than.
struct Seams {
    seams: Vec<usize>,
    bound: f64,
}

/// What searches of one graph for closed routes share, whatever the slack.
#[derive(Debug, Clone, Default)]
pub(super) struct ClosedRoutes {
    /// The best route twice round.
    round: Option<Route>,
    /// The best closed routes, by the seams of the open routes that they were searched from.
    best: Vec<([usize; 2], Route)>,
}

impl ClosedRoutes {
    /// The best route that closes: through all layers, none at all, or, where even the `open` one breaks off, that one.
    pub fn route(&mut self, graph: &Graph, search: &Search, open: Route) -> Route {
        let (Some(&first), Some(&last)) = (open.cells.first(), open.cells.last()) else { return open };
        if open.cells.len() < graph.layers() {
            return open;
        }
        let seams = [graph.seam(first), graph.seam(last)];
        let known = self.best.iter().find(|(hint, _)| *hint == seams).map(|(_, best)| best.clone());
        let best = known.unwrap_or_else(|| {
            let round = self.round.get_or_insert_with(|| graph.twice().sweep(search, None, None));
            let best = best_closed(graph, search, None, &open, round);
            self.best.push((seams, best.clone()));
            best
        });
        if search.criterion == Criterion::Integral || best.cells.is_empty() {
            return best;
        }
        let (under, ceiling) = search.under(&best);
        let round = graph.twice().sweep(&under, None, Some(ceiling));
        let smooth = best_closed(graph, &under, Some(ceiling), &best, &round);
        Route { cost: best.cost, ..smooth }
    }
}

/// The best route that closes. The best open one from a set of postures to the same set bounds what closes within it; sets are halved between
/// its ends until it closes. The first seams to be tried are those of `hint` and of the best route twice `round`.
fn best_closed(graph: &Graph, search: &Search, ceiling: Option<f64>, hint: &Route, round: &Route) -> Route {
    let last = graph.layers() - 1;
    let closing = |seams: &[usize]| {
        let mut ends = vec![false; graph.cells()];
        seams.iter().for_each(|&seam| ends[seam * graph.copies..(seam + 1) * graph.copies].fill(true));
        let route = graph.sweep(search, Some(&ends), ceiling);
        (route.cells.len() > last && route.cost.is_finite()).then_some(route)
    };
    let mut best = Route { cells: Vec::new(), cost: f64::INFINITY, frontier: Vec::new() };
    for &cell in [hint.cells.first(), hint.cells.last(), round.cells.get(last)].into_iter().flatten() {
        best = better(best, closing(&[graph.seam(cell)]));
    }
    let mut sets = vec![Seams { seams: graph.seams(), bound: f64::NEG_INFINITY }];
    for at_most in 0..MAX_SEARCHES.min(MAX_STEPS / graph.steps_of_sweep(search).max(1)) {
        let Some(at) = (0..sets.len()).min_by(|&i, &j| sets[i].bound.total_cmp(&sets[j].bound)) else { break };
        let set = sets.swap_remove(at);
        if set.bound >= best.cost - CLOSE * best.cost.abs() {
            break;
        }
        let Some(route) = closing(&set.seams) else { continue };
        let [first, end] = [0, last].map(|layer| graph.seam(route.cells[layer]));
        if first == end {
            best = better(best, Some(route));
            continue;
        }
        let bound = route.cost;
        if at_most % TRIED == 0 {
            for seam in [first, end] {
                best = better(best, closing(&[seam]));
            }
        }
        let place = |seam| set.seams.iter().position(|&other| other == seam).unwrap_or(0);
        let (left, right) = set.seams.split_at((place(first) + place(end)).div_ceil(2));
        sets.extend([left, right].map(|seams| Seams { seams: seams.to_vec(), bound }));
    }
    best
}

fn better(old: Route, new: Option<Route>) -> Route {
    match new {
        Some(new) if new.cost < old.cost => new,
        _ => old,
    }
}
