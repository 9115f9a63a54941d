//! Ways through a graph that are not one: on other branches, or on the other side of postures that are closed or much worse.

use super::graph::{Criterion, Graph, Labels, Route, Search};

/// Layers through which other ways are looked for.
const LOOKED_AT: usize = 16;
/// Candidates that are looked at, the cheapest first.
const CANDIDATES: usize = 96;
/// Values this much above those at both sides, relative, part two ways.
const RIDGE: f64 = 0.5;

/// The best route of every way, the cheapest first, `most` at most; only routes through all layers.
pub(super) fn ways(graph: &Graph, search: &Search, most: usize) -> Vec<Route> {
    if graph.layers() < 2 {
        return Vec::new();
    }
    let (to, from) = (graph.labels(search, None, None), graph.reversed().labels(search, None, None));
    if to.len() < graph.layers() || from.len() < graph.layers() {
        return Vec::new();
    }
    let mut found: Vec<Route> = Vec::new();
    for (cost, layer, cell) in candidates(graph, search, &to, &from) {
        if found.len() == most {
            break;
        }
        let cells = through(&to, &from, layer, cell);
        if found.iter().all(|other| !is_one(graph, &other.cells, &cells)) {
            found.push(Route { cells, cost, frontier: Vec::new() });
        }
    }
    found
}

/// The best routes through cells of the middle layer, `spins` evenly on every branch; only routes through all layers.
pub(super) fn spread(graph: &Graph, search: &Search, spins: usize) -> Vec<Route> {
    if graph.layers() < 2 {
        return Vec::new();
    }
    let (to, from) = (graph.labels(search, None, None), graph.reversed().labels(search, None, None));
    let (layer, last) = (graph.layers() / 2, graph.layers() - 1);
    if to.len() <= last || from.len() <= last {
        return Vec::new();
    }
    let stride = (graph.cells() / graph.branches).div_ceil(spins);
    let cells = (0..graph.cells()).filter(|cell| (cell / graph.branches).is_multiple_of(stride));
    let open = cells.filter(|&cell| (to[layer].cost[cell] + from[last - layer].cost[cell]).is_finite());
    open.map(|cell| Route { cells: through(&to, &from, layer, cell), cost: to[layer].cost[cell], frontier: Vec::new() }).collect()
}

/// Cells that are the best of their surroundings to pass through, with what the best route through them costs, the cheapest first.
fn candidates(graph: &Graph, search: &Search, to: &[Labels], from: &[Labels]) -> Vec<(f64, usize, usize)> {
    let last = graph.layers() - 1;
    let cost = |layer: usize, cell: usize| {
        let (a, b) = (to[layer].cost[cell], from[last - layer].cost[cell]);
        match search.criterion {
            _ if !(a + b).is_finite() => f64::INFINITY,
            Criterion::Minimax => a.max(b),
            Criterion::Integral => a + b - graph.own(search, layer, cell),
        }
    };
    let stride = graph.layers().div_ceil(LOOKED_AT);
    let mut all: Vec<(f64, usize, usize)> = Vec::new();
    for layer in (0..=last).step_by(stride).chain([last]) {
        for cell in 0..graph.cells() {
            let here = cost(layer, cell);
            if here.is_finite() && beside(graph, search, cell).iter().all(|&other| cost(layer, other) >= here) {
                all.push((here, layer, cell));
            }
        }
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    // The cheapest of every branch comes before the rest.
    let mut seen = vec![false; graph.branches];
    let (mut first, rest): (Vec<_>, Vec<_>) = all.into_iter().partition(|c| !std::mem::replace(&mut seen[c.2 % graph.branches], true));
    first.extend(rest);
    first.truncate(CANDIDATES);
    first.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    first
}

/// The cells of the same branch at the spins beside.
fn beside(graph: &Graph, search: &Search, cell: usize) -> Vec<usize> {
    let (angles, b) = (graph.angles, graph.branches);
    let (sample, branch) = (cell / b, cell % b);
    let (slice, angle) = (sample / angles, sample % angles);
    let at = |angle: usize| (slice * angles + angle) * b + branch;
    let before = if angle > 0 { Some(angle - 1) } else { search.around.then_some(angles - 1) };
    let after = if angle + 1 < angles { Some(angle + 1) } else { search.around.then_some(0) };
    before.into_iter().chain(after).filter(|&other| other != angle).map(at).collect()
}

/// The best route through a cell.
fn through(to: &[Labels], from: &[Labels], layer: usize, cell: usize) -> Vec<usize> {
    let last = to.len() - 1;
    let mut cells = vec![cell; last + 1];
    let mut at = cell;
    for k in (1..=layer).rev() {
        at = to[k].from[at] as usize;
        cells[k - 1] = at;
    }
    at = cell;
    for k in layer..last {
        at = from[last - k].from[at] as usize;
        cells[k + 1] = at;
    }
    cells
}

/// Whether two routes are one way: on the same branches, with nothing closed, and no ridge, between them.
fn is_one(graph: &Graph, a: &[usize], b: &[usize]) -> bool {
    (0..a.len()).all(|layer| {
        let (angles, branches) = (graph.angles, graph.branches);
        if a[layer] % branches != b[layer] % branches {
            return false;
        }
        let split = |cell: usize| (cell / branches / angles, cell / branches % angles);
        let ((slice, from), (other, to)) = (split(a[layer]), split(b[layer]));
        if slice != other {
            // Neighbours in a grid of joints to spare are one way.
            return slice.abs_diff(other) <= 2;
        }
        let value = |cell: usize| graph.value_of(layer, cell);
        let ceiling = value(a[layer]).max(value(b[layer]));
        let ceiling = ceiling + RIDGE * ceiling.abs();
        let ahead = (to + angles - from) % angles;
        let (start, steps) = if 2 * ahead <= angles { (from, ahead) } else { (to, angles - ahead) };
        (0..=steps).all(|k| {
            let cell = (slice * angles + (start + k) % angles) * branches + a[layer] % branches;
            graph.open(layer, cell) && value(cell) <= ceiling
        })
    })
}
