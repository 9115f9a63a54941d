//! Grids of the spin and of the joints that a robot has to spare.

use std::f64::consts::{PI, TAU};

use super::numbers::{half_open, linspace, shown};
use super::settings::PlanSettings;
use super::spare::{choices, fits};
use crate::error::{Error, Result};
use crate::robot::{AT_LIMIT, Joint, Robot};
use crate::task::Task;

/// How far from its limits a spare joint's grid begins, relative to its range.
const EDGE: f64 = 1e-3;
/// Values of a joint that are so few that each stands for the middle of its part of the range.
const FEW: usize = 6;
/// Values of the only joint that is held: alone, and where spins are on the grid as well.
const ALONE: (usize, usize) = (120, 24);
/// Combinations of the values of several joints, about: alone, and beside spins.
const TOGETHER: (usize, usize) = (1000, 64);
/// Values of each of two joints.
const OF_TWO: usize = 24;
/// Which part of these there are in each joint where cells are solved by Newton alone.
const SEARCHED: usize = 2;
/// Which part of its range a spare joint may pass from one point of a search to the next.
const SHARE: usize = 8;
/// Combinations of the values of held joints at most, times as many as there are spins on the grid.
const MOST: usize = 1 << 18;

/// The spins of a grid \[rad\]: from -pi over a whole turn, from end to end of a range, or 0 where the tool does not spin freely.
///
/// # Errors
/// [`Error::Value`] if there is not at least one angle, or the range is not one.
pub fn angle_grid(spins: bool, n_angles: usize, spin_range: Option<(f64, f64)>) -> Result<Vec<f64>> {
    if !spins {
        return Ok(vec![0.0]);
    }
    if n_angles < 1 {
        return Err(Error::value("n_angles", n_angles, "at least 1"));
    }
    let Some((low, high)) = spin_range else { return Ok(half_open(-PI, PI, n_angles)) };
    if !(low.is_finite() && high.is_finite() && low < high && high <= low + 2.0 * PI) {
        let given = format!("({}, {})", shown(low), shown(high));
        let degrees = if low < high && high - low <= 360.0 { "; degrees?" } else { "" };
        return Err(Error::value("spin_range", given, &format!("two increasing angles at most a turn apart [rad]{degrees}")));
    }
    Ok(if n_angles > 1 { linspace(low, high, n_angles) } else { vec![0.5 * (low + high)] })
}

/// Joints that are held on a grid, counted from 0, and every combination of their values [rad or m], one a row.
#[derive(Debug, Clone, PartialEq)]
pub struct SpareGrid {
    /// The joints.
    pub joints: Vec<usize>,
    /// Number of values of each joint; their product is the number of rows.
    pub counts: Vec<usize>,
    /// Of each joint, whether its values go round a whole turn, so that the last is next to the first.
    pub around: Vec<bool>,
    /// Their values, those of the last joint running fastest; one row, an empty one, without joints.
    pub values: Vec<Vec<f64>>,
    /// Whether the tool of the others may spin as it likes, so that its spins are on a grid too.
    pub spins: bool,
    /// The range of each joint [rad or m].
    ranges: Vec<(f64, f64)>,
}

impl SpareGrid {
    /// Over the joints that the settings name, or else those that suit best: the first of [`SpareGrid::choices`].
    ///
    /// # Errors
    /// As for [`SpareGrid::choices`].
    pub fn new(robot: &Robot, task: &Task, settings: &PlanSettings) -> Result<Self> {
        Ok(Self::choices(robot, task, settings)?.swap_remove(0))
    }

    /// The joints that may be held, the best choice first, at least one and at most four: the joints that the settings name alone; else those whose values tell
    /// most about a posture, weighed against how hard it is to solve for the others. A turntable or a rail beside six joints that turn comes first.
    ///
    /// # Errors
    /// [`Error::Value`] if what is left does not fit the task, or a joint slides without limits.
    pub fn choices(robot: &Robot, task: &Task, settings: &PlanSettings) -> Result<Vec<Self>> {
        if settings.n_spare.is_some_and(|count| count < 1) {
            return Err(Error::value("n_spare", 0, "at least 1"));
        }
        let Some(joints) = &settings.spare else {
            let found = choices(robot, task)?;
            let grids = found.into_iter().map(|choice| {
                let searched = choice.is_searched();
                Self::over(robot, choice.joints, settings.n_spare, choice.spins, searched)
            });
            let (grids, errors): (Vec<_>, Vec<_>) = grids.partition(Result::is_ok);
            let grids: Vec<Self> = grids.into_iter().flatten().collect();
            // A joint that slides without end has no grid; another choice may do without it.
            return if grids.is_empty() { errors.into_iter().collect::<Result<Vec<_>>>() } else { Ok(grids) };
        };
        let spins = fitting(robot, task, joints)?;
        Ok(vec![Self::over(robot, joints.clone(), settings.n_spare, spins, false)?])
    }

    /// Of given values, one row each, of joints.
    ///
    /// # Errors
    /// [`Error::Value`] if what is left does not fit the task.
    pub fn at(robot: &Robot, task: &Task, joints: &[usize], values: Vec<Vec<f64>>) -> Result<Self> {
        let spins = fitting(robot, task, joints)?;
        let k = joints.len();
        let counts = (0..k).map(|i| if i == 0 { values.len() } else { 1 }).collect();
        Ok(Self { joints: joints.to_vec(), counts, around: vec![false; k], values, spins, ranges: vec![(0.0, 0.0); k] })
    }

    /// The same with `times` as many values of every joint, but no more than a search can hold.
    pub fn finer(&self, times: usize) -> Self {
        let mut counts: Vec<usize> = self.counts.iter().map(|count| count * times.max(1)).collect();
        while counts.iter().product::<usize>() > MOST.max(self.values.len()) {
            counts.iter_mut().zip(&self.counts).for_each(|(count, least)| *count = (*count - 1).max(*least));
        }
        Self { values: rows(&self.ranges, &self.around, &counts), counts, ..self.clone() }
    }

    /// The same with half as many values of every joint, where there are tilts beside them.
    pub fn coarser(&self) -> Self {
        let counts: Vec<usize> = self.counts.iter().map(|count| count.div_ceil(2)).collect();
        Self { values: rows(&self.ranges, &self.around, &counts), counts, ..self.clone() }
    }

    /// The rows that a path may come from to get to each: in every joint an eighth of its values to either side, at least one.
    pub fn neighbours(&self) -> Vec<Vec<usize>> {
        let mut all = vec![vec![0]];
        for (&count, &around) in self.counts.iter().zip(&self.around) {
            let near = |i: usize| nearby(i, count, around);
            all = all
                .iter()
                .flat_map(|before| {
                    let joined = |i: usize| before.iter().flat_map(|row| near(i).into_iter().map(move |k| row * count + k)).collect();
                    (0..count).map(joined).collect::<Vec<Vec<usize>>>()
                })
                .collect();
        }
        all
    }

    /// The rows in an order in which every one differs from the one before it by one step of one joint.
    pub fn order(&self) -> Vec<usize> {
        self.counts.iter().fold(vec![0], |before, &count| {
            let there_and_back = |(i, row): (usize, &usize)| {
                let (row, back) = (*row, i % 2 == 1);
                (0..count).map(move |k| row * count + if back { count - 1 - k } else { k })
            };
            before.iter().enumerate().flat_map(there_and_back).collect()
        })
    }

    fn over(robot: &Robot, joints: Vec<usize>, count: Option<usize>, spins: bool, searched: bool) -> Result<Self> {
        let spans: Vec<((f64, f64), bool)> = joints.iter().map(|joint| span(robot, *joint)).collect::<Result<_>>()?;
        let (ranges, around): (Vec<_>, Vec<_>) = spans.into_iter().unzip();
        let mut counts = count.map_or_else(|| usual_counts(joints.len(), spins), |count| vec![count; joints.len()]);
        if count.is_none() && searched {
            counts.iter_mut().for_each(|count| *count = (*count / SEARCHED).max(2.min(*count)));
        }
        let cells = counts.iter().try_fold(1usize, |cells, count| cells.checked_mul(*count)).filter(|cells| *cells <= MOST);
        if cells.is_none() {
            let given = format!("{} for each of {} joints", counts[0], joints.len());
            return Err(Error::value("n_spare", given, &format!("so few that there are at most {MOST} combinations")));
        }
        Ok(Self { values: rows(&ranges, &around, &counts), joints, counts, around, spins, ranges })
    }
}

/// Whether the tool of what is left may spin when joints are held.
fn fitting(robot: &Robot, task: &Task, joints: &[usize]) -> Result<bool> {
    if let Some(spins) = fits(robot, joints, task)? {
        return Ok(spins);
    }
    let letters = robot.joint_letters();
    let left: String = letters.chars().enumerate().filter(|(i, _)| !joints.contains(i)).map(|(_, letter)| letter).collect();
    let given = format!("{}, which leaves the joints '{left}' of '{letters}'", tuple(joints));
    Err(Error::value("spare", given, "six revolute ones, or as many as the task and its free spin take"))
}

/// How many values each of so many joints has if nothing is said.
fn usual_counts(joints: usize, spins: bool) -> Vec<usize> {
    let of = |pair: (usize, usize)| if spins { pair.1 } else { pair.0 };
    match joints {
        0 => Vec::new(),
        1 => vec![of(ALONE)],
        2 if !spins => vec![OF_TWO; 2],
        _ => {
            let mut counts = vec![1; joints];
            // As even as can be: one value more for each in turn, while there is room.
            loop {
                for i in 0..joints {
                    counts[i] += 1;
                    if counts.iter().product::<usize>() > of(TOGETHER) {
                        counts[i] -= 1;
                        return counts;
                    }
                }
            }
        }
    }
}

/// Every combination of values.
fn rows(ranges: &[(f64, f64)], around: &[bool], counts: &[usize]) -> Vec<Vec<f64>> {
    let mut rows = vec![Vec::new()];
    for ((range, around), count) in ranges.iter().zip(around).zip(counts) {
        let column = column(*range, *around, *count);
        rows = rows.iter().flat_map(|row| column.iter().map(|x| [&row[..], &[*x]].concat())).collect();
    }
    rows
}

/// The range in which the values of a joint are, and whether it is a whole turn: a joint that turns further comes round to the same postures.
fn span(robot: &Robot, joint: usize) -> Result<((f64, f64), bool)> {
    let limits = robot.limits();
    let (low, high) = (limits.q_min[joint], limits.q_max[joint]);
    if robot.is_periodic(joint) && high - low >= TAU - 2.0 * AT_LIMIT {
        let start = (limits.middle(joint) - PI).max(low).min(high - TAU);
        return Ok(((start, start + TAU), true));
    }
    if limits.is_bounded(joint) {
        return Ok(((low, high), false));
    }
    if robot.joints()[joint] == Joint::Prismatic {
        return Err(Error::value(&format!("joint {}", joint + 1), "sliding without limits", "limits for a spare joint"));
    }
    Ok((robot.span(joint), false))
}

/// The values of a spare joint.
fn column((low, high): (f64, f64), around: bool, count: usize) -> Vec<f64> {
    if around {
        return half_open(low, high, count);
    }
    if count <= FEW {
        let half = 0.5 * (high - low) / count as f64;
        return linspace(low + half, high - half, count);
    }
    let edge = EDGE * (high - low);
    linspace(low + edge, high - edge, count)
}

/// The places of a row of values that are near to one, in order.
fn nearby(i: usize, count: usize, around: bool) -> Vec<usize> {
    let window = (count / SHARE).max(1);
    if !around {
        return (i.saturating_sub(window)..=(i + window).min(count - 1)).collect();
    }
    if 2 * window + 1 >= count {
        return (0..count).collect();
    }
    (0..=2 * window).map(|k| (i + count + k - window) % count).collect()
}

/// Numbers as Python shows a tuple of them.
fn tuple(numbers: &[usize]) -> String {
    let shown: Vec<String> = numbers.iter().map(ToString::to_string).collect();
    format!("({}{})", shown.join(", "), if numbers.len() == 1 { "," } else { "" })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::{Convention, DhTable};

    fn planar(joints: usize) -> Result<Robot> {
        let zero = vec![0.0; joints];
        let table = DhTable { convention: Convention::Standard, a: vec![1.0; joints], d: zero.clone(), alpha: zero.clone(), theta: zero };
        Robot::from_dh("planar", table, &"R".repeat(joints))
    }

    #[test]
    fn neighbours_are_near_in_every_joint_and_go_round() -> Result<()> {
        let settings = PlanSettings { n_spare: Some(5), ..PlanSettings::default() };
        let grid = SpareGrid::new(&planar(4)?, &Task::POSITION, &settings)?;
        assert_eq!((grid.joints.len(), grid.counts.clone(), grid.around.clone()), (2, vec![5, 5], vec![true, true]));
        let near = grid.neighbours();
        let mut first = near[0].clone();
        first.sort_unstable();
        assert_eq!(first, [0, 1, 4, 5, 6, 9, 20, 21, 24]);
        assert!(near.iter().all(|row| row.len() == 9));
        let order = grid.order();
        assert!(order.windows(2).all(|pair| (pair[0] / 5).abs_diff(pair[1] / 5) + (pair[0] % 5).abs_diff(pair[1] % 5) == 1));
        Ok(())
    }

    #[test]
    fn finer_grids_have_more_values_of_every_joint_but_not_without_end() -> Result<()> {
        let grid = SpareGrid::new(&planar(4)?, &Task::POSITION, &PlanSettings::default())?;
        assert_eq!(grid.finer(2).counts, [48, 48]);
        assert_eq!(grid.finer(2).values.len(), 48 * 48);
        assert!(grid.finer(1000).values.len() <= MOST);
        Ok(())
    }
}
