//! Joints that stay at 0 beside those that a robot has, chosen so that the six are solved in closed form and are nowhere singular without need.

use super::chain::{Chain, Role, along};
use super::six::Six;
use crate::error::Result;
use crate::kinematics::jacobian_at;
use crate::linalg::frame::Frame;
use crate::linalg::orthogonal::Orthogonal;
use crate::linalg::vector::{cross, norm, unit};
use crate::robot::{Joint, RandomPostures};
use crate::task::Task;

/// Postures tried.
const POSTURES: usize = 4;
/// A chain whose orthogonal rows have a shortest over longest below this in all of them is singular everywhere.
const SINGULAR: f64 = 1e-6;
/// Chains that are kept: where one has a continuum of postures, another need not have it.
const KEPT: usize = 3;

/// The chains of six joints that a shorter one is part of, the best first; none where none is solved.
pub fn padded(chain: &Chain) -> Result<Vec<Six>> {
    let mut rated: Vec<(u8, f64, Six)> = Vec::new();
    for candidate in candidates(chain) {
        // Another order may have a form where this one has none.
        let forms = candidate.orders().iter().map(Six::new).collect::<Result<Vec<_>>>()?;
        if let Some(six) = forms.into_iter().flatten().next() {
            let (effort, spread) = (six.structure().effort(), spread(&six));
            if spread > SINGULAR || candidate.joints.len() == chain.joints.len() {
                rated.push((effort, spread, six));
            }
        }
    }
    let mut kept = Vec::new();
    while kept.len() < KEPT && !rated.is_empty() {
        let better = |a: usize, b: usize| rated[a].0 < rated[b].0 || (rated[a].0 == rated[b].0 && rated[a].1 >= rated[b].1);
        let best = (1..rated.len()).fold(0, |best, i| if better(best, i) { best } else { i });
        kept.push(rated.swap_remove(best).2);
    }
    Ok(kept)
}

/// Shortest over longest orthogonal row of the Jacobian at the best of some postures with the still joints at 0.
fn spread(six: &Six) -> f64 {
    let robot = six.robot();
    let size = robot.links().iter().chain([robot.end()]).map(|link| norm(link.origin)).sum::<f64>();
    let mut postures = RandomPostures::new(1);
    (0..POSTURES).fold(0.0, |best: f64, _| {
        let mut q = [0.0; 6];
        postures.fill(robot, &mut q);
        q.iter_mut().zip(six.roles()).filter(|(_, role)| **role == Role::Still).for_each(|(x, _)| *x = 0.0);
        let (tool, columns) = jacobian_at(robot, &q);
        let rows = Task::FULL.directions(&tool, if size > 0.0 { size } else { 1.0 }).rows(&columns);
        best.max(Orthogonal::new(&rows, 6, 6).spread())
    })
}

/// Chains to choose from.
fn candidates(chain: &Chain) -> Vec<Chain> {
    let missing = 6usize.saturating_sub(chain.joints.len());
    if missing == 0 {
        return vec![chain.clone()];
    }
    let turns = |i: usize| chain.joints[i] == Joint::Revolute;
    let mut seeds = vec![chain.clone()];
    for i in (0..chain.joints.len()).filter(|&i| turns(i)) {
        // A wrist of this joint and two still ones.
        let mut seed = chain.clone();
        seed.insert(i + 1, Joint::Revolute, Role::Still, along([0.0, 1.0, 0.0]));
        seed.insert(i + 2, Joint::Revolute, Role::Still, along([1.0, 0.0, 0.0]));
        seeds.push(seed);
        // A wrist of two that meet and one still joint across both, between them, where it never comes in line.
        if i + 1 < chain.joints.len()
            && turns(i + 1)
            && let Some((height, _)) = crate::inverse::analytic::structure::meeting(&chain.links[i + 1], size(chain))
            && let Some(axis) = unit(cross([0.0, 0.0, 1.0], chain.links[i + 1].axes[2]))
        {
            let mut seed = chain.clone();
            seed.insert(i + 1, Joint::Revolute, Role::Still, Frame { origin: [0.0, 0.0, height], ..along(axis) });
            seeds.push(seed);
        }
    }
    // A wrist of three still ones.
    let mut seed = chain.clone();
    seed.append_ball(Role::Still);
    seeds.push(seed);
    for axis in Frame::IDENTITY.axes {
        let mut seed = chain.clone();
        seed.append(Joint::Revolute, Role::Still, axis);
        seeds.push(seed);
    }
    seeds.iter().flat_map(with_slides).collect()
}

fn size(chain: &Chain) -> f64 {
    chain.links.iter().map(|link| norm(link.origin)).sum()
}

/// The chain with still slides along some axes of the base, so that it has six joints.
fn with_slides(seed: &Chain) -> Vec<Chain> {
    let subsets = 0u32..8;
    let fitting = subsets.filter(|subset| seed.joints.len() + subset.count_ones() as usize == 6);
    fitting
        .map(|subset| {
            let mut chain = seed.clone();
            for (i, axis) in Frame::IDENTITY.axes.into_iter().enumerate() {
                if subset >> i & 1 == 1 {
                    chain.insert(0, Joint::Prismatic, Role::Still, along(axis));
                }
            }
            chain
        })
        .collect()
}
