//! The planner's parts that know no robot: band matrices, routes through small graphs against all of them, whole turns.

use std::f64::consts::{PI, TAU};

use redundancy::internals::linalg::Banded;
use redundancy::plan::{Criterion, Graph, JointWeights, Search, find_route, unwind, within_limits};
use redundancy::robot::Limits;

use crate::common::Rng;

#[test]
fn band_matrices_are_solved_as_dense_ones() {
    let mut rng = Rng(11);
    for _ in 0..200 {
        let (n, width) = (1 + rng.below(30), rng.below(5));
        let mut dense = vec![vec![0.0; n]; n];
        let mut band = Banded::new(n, width);
        for i in 0..n {
            for j in i.saturating_sub(width)..=i {
                let x = if i == j { 2.0 * width as f64 + 1.0 } else { rng.within(-1.0, 1.0) };
                band.add(i, j, x);
                (dense[i][j], dense[j][i]) = (x, x);
            }
        }
        let x: Vec<f64> = (0..n).map(|_| rng.within(-1.0, 1.0)).collect();
        let shift = rng.within(0.0, 1.0);
        let mut b: Vec<f64> = (0..n).map(|i| (0..n).map(|j| dense[i][j] * x[j]).sum::<f64>() + shift * x[i]).collect();
        let mut factor = band.clone();
        assert!(band.factor_into(shift, &mut factor));
        factor.solve(&mut b);
        assert!(b.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-12));
        // Far below zero on the diagonal it has no factor, and says so.
        assert!(!band.factor_into(-10.0 * (2.0 * width as f64 + 1.0), &mut factor));
    }
}

/// A graph of one joint whose cells are drawn at random.
fn drawn(rng: &mut Rng, layers: usize, angles: usize, branches: usize) -> Graph {
    let cells = angles * branches;
    let count = layers * cells;
    Graph {
        n: 1,
        slices: 1,
        near: [vec![0]].into(),
        angles,
        branches,
        named: true,
        copies: 1,
        q: (0..count).map(|_| rng.within(-2.0, 2.0)).collect(),
        value: (0..count).map(|_| rng.within(1.0, 5.0)).collect(),
        cause: (0..count).map(|_| u8::from(rng.below(5) == 0)).collect(),
        wide: vec![false],
        joint_weights: JointWeights::new(1, None).unwrap(),
        weights: vec![1.0 / layers as f64; layers],
        steps: vec![1.0 / (layers - 1) as f64; layers - 1],
        bounds: vec![2.5; layers - 1],
        pace: None,
        edges: None,
    }
}

/// Cost of the best of all routes, tried one by one.
fn exhaustive(graph: &Graph, search: &Search, closed: bool) -> f64 {
    fn extend(graph: &Graph, search: &Search, route: &mut Vec<usize>, closed: bool, best: &mut f64) {
        let layer = route.len();
        if layer == graph.layers() {
            if !closed || route[0] == route[layer - 1] {
                *best = best.min(cost(graph, search, route));
            }
            return;
        }
        for cell in 0..graph.cells() {
            if graph.cause[layer * graph.cells() + cell] == 0 && route.last().is_none_or(|&from| allowed(graph, search, layer, from, cell))
            {
                route.push(cell);
                extend(graph, search, route, closed, best);
                route.pop();
            }
        }
    }
    let mut best = f64::INFINITY;
    extend(graph, search, &mut Vec::new(), closed, &mut best);
    best
}

fn allowed(graph: &Graph, search: &Search, layer: usize, from: usize, to: usize) -> bool {
    let (a, b) = (from / graph.branches, to / graph.branches);
    let apart = a.abs_diff(b);
    let apart = if search.around { apart.min(graph.angles - apart) } else { apart };
    let motion = (graph.posture(layer, to)[0] - graph.posture(layer - 1, from)[0]).abs();
    let largest = if from % graph.branches == to % graph.branches { PI } else { search.branch_step };
    apart <= search.window && motion <= graph.bounds[layer - 1] && motion <= largest && largest > 0.0
}

fn cost(graph: &Graph, search: &Search, route: &[usize]) -> f64 {
    let value = |layer: usize| graph.value[layer * graph.cells() + route[layer]];
    if search.criterion == Criterion::Minimax {
        return (0..route.len()).map(value).fold(0.0, f64::max);
    }
    let motion: f64 = (1..route.len())
        .map(|layer| {
            (graph.posture(layer, route[layer])[0] - graph.posture(layer - 1, route[layer - 1])[0]).powi(2) / graph.steps[layer - 1]
        })
        .sum();
    (0..route.len()).map(|layer| graph.weights[layer] * value(layer)).sum::<f64>() + search.smoothness * motion
}

#[test]
fn routes_are_the_best_of_all() {
    let mut rng = Rng(12);
    for round in 0..300 {
        let layers = 2 + rng.below(4);
        let graph = drawn(&mut rng, layers, 4, 2);
        let search = Search {
            criterion: if round % 2 == 0 { Criterion::Minimax } else { Criterion::Integral },
            smoothness: rng.within(0.0, 0.5),
            window: 1 + rng.below(2),
            around: rng.below(2) == 0,
            branch_step: [0.0, 0.7][rng.below(2)],
            slack: 0.0,
        };
        let best = exhaustive(&graph, &search, false);
        let found = find_route(&graph, &search, None, false);
        if best.is_finite() {
            assert_eq!(found.cells.len(), layers);
            assert!((found.cost - best).abs() < 1e-12, "{} {best}", found.cost);
            assert!((cost(&graph, &search, &found.cells) - best).abs() < 1e-12);
            assert!((1..layers).all(|layer| allowed(&graph, &search, layer, found.cells[layer - 1], found.cells[layer])));
        } else {
            assert!(found.cells.len() < layers);
        }
    }
}

#[test]
fn closed_routes_end_where_they_begin() {
    let mut rng = Rng(13);
    for round in 0..400 {
        let mut graph = drawn(&mut rng, 5, 4, 2);
        let (cells, last) = (graph.cells(), 4 * graph.cells());
        for cell in 0..cells {
            graph.q[last + cell] = graph.q[cell];
            graph.value[last + cell] = graph.value[cell];
            graph.cause[last + cell] = graph.cause[cell];
        }
        let search = Search {
            criterion: if round % 2 == 0 { Criterion::Minimax } else { Criterion::Integral },
            smoothness: 0.1,
            window: 2,
            around: true,
            branch_step: [0.0, 0.7][rng.below(2)],
            slack: 0.0,
        };
        let best = exhaustive(&graph, &search, true);
        let found = find_route(&graph, &search, None, true);
        if best.is_finite() {
            assert_eq!(found.cells[0], found.cells[4]);
            assert!((found.cost - best).abs() < 1e-12, "{} {best}", found.cost);
            assert!((cost(&graph, &search, &found.cells) - best).abs() < 1e-12);
        } else {
            // None closes: what is told is how far an open one leads.
            assert!(found.cells.is_empty() || found.cells.len() < 5);
        }
    }
}

#[test]
fn a_closed_route_may_end_whole_turns_from_where_it_begins() {
    let layers = 9;
    let angle = |layer: usize| TAU * layer as f64 / (layers - 1) as f64;
    let graph = Graph {
        n: 1,
        slices: 1,
        near: [vec![0]].into(),
        angles: 1,
        branches: 1,
        named: true,
        copies: 1,
        q: (0..layers).map(|layer| angle(layer) - TAU * (angle(layer) / TAU).round()).collect(),
        value: vec![1.0; layers],
        cause: vec![0; layers],
        wide: vec![true],
        joint_weights: JointWeights::new(1, None).unwrap(),
        weights: vec![1.0 / layers as f64; layers],
        steps: vec![1.0 / (layers - 1) as f64; layers - 1],
        bounds: vec![1.0; layers - 1],
        pace: None,
        edges: None,
    };
    let search = Search { criterion: Criterion::Integral, smoothness: 1.0, window: 1, around: false, branch_step: 0.0, slack: 0.0 };
    // Every turn is a branch of its own.
    let turned = graph.with_turns(0, -1.2 * TAU, 1.2 * TAU);
    let limits = Limits { q_min: vec![-1.2 * TAU], q_max: vec![1.2 * TAU], ..Limits::none(1) };
    let found = find_route(&turned, &search, Some(&limits), true);
    assert_eq!(found.q.len(), layers);
    assert!((found.q[layers - 1] - found.q[0] - TAU).abs() < 1e-12);
}

#[test]
fn whole_turns_are_searched_only_where_limits_ask_for_them() {
    // A joint that follows a path of two turns, within limits of one and a half either way: it has to begin low.
    let layers = 25;
    let angle = |layer: usize| 2.0 * TAU * layer as f64 / (layers - 1) as f64;
    let wrapped = |x: f64| x - TAU * (x / TAU).round();
    let graph = Graph {
        n: 1,
        slices: 1,
        near: [vec![0]].into(),
        angles: 1,
        branches: 1,
        named: true,
        copies: 1,
        q: (0..layers).map(|layer| wrapped(angle(layer))).collect(),
        value: vec![1.0; layers],
        cause: vec![0; layers],
        wide: vec![true],
        joint_weights: JointWeights::new(1, None).unwrap(),
        weights: vec![1.0 / layers as f64; layers],
        steps: vec![1.0 / (layers - 1) as f64; layers - 1],
        bounds: vec![f64::INFINITY; layers - 1],
        pace: None,
        edges: None,
    };
    let search = Search { criterion: Criterion::Integral, smoothness: 1.0, window: 1, around: false, branch_step: 0.0, slack: 0.0 };
    let limits = |low: f64, high: f64| Limits { q_min: vec![low], q_max: vec![high], ..Limits::none(1) };
    let found = find_route(&graph, &search, Some(&limits(-1.5 * TAU, 1.5 * TAU)), false);
    assert_eq!(found.q.len(), layers);
    for (layer, q) in found.q.iter().enumerate() {
        assert!((q - (angle(layer) - TAU)).abs() < 1e-12);
    }
    // Within three quarters of a turn either way it can begin at 0 alone, and three quarters of a turn are all that there is.
    let part = find_route(&graph, &search, Some(&limits(-0.75 * TAU, 0.75 * TAU)), false);
    assert_eq!(part.q.len(), 1 + 3 * (layers - 1) / 8);
    assert!(part.q.iter().all(|q| q.abs() <= 0.75 * TAU));
}

#[test]
fn unwinding_is_continuous_and_shifts_by_whole_turns() {
    let mut rng = Rng(14);
    for _ in 0..100 {
        let mut angle = rng.within(-3.0, 3.0);
        let path: Vec<f64> = (0..50)
            .map(|_| {
                angle += rng.within(-1.0, 1.0);
                angle
            })
            .collect();
        let mut q: Vec<f64> = path.iter().map(|x| x - TAU * (x / TAU).round()).collect();
        unwind(&mut q, 1, &[true]);
        let shift = q[0] - path[0];
        assert!(q.iter().zip(&path).all(|(a, b)| (a - b - shift).abs() < 1e-9));
        let limits = Limits { q_min: vec![-40.0], q_max: vec![40.0], ..Limits::none(1) };
        assert_eq!(within_limits(&mut q, 1, &[true], &limits), Ok(()));
        let middle = 0.5 * (q.iter().copied().fold(f64::MAX, f64::min) + q.iter().copied().fold(f64::MIN, f64::max));
        assert!(middle.abs() <= PI + 1e-9);
        assert_eq!(within_limits(&mut q, 1, &[true], &Limits { q_min: vec![-0.1], q_max: vec![0.1], ..Limits::none(1) }), Err(0));
    }
}
