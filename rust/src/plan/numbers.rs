//! Sums, grids and interpolation of plain numbers.

/// Longest run that is added without halving it first.
const BLOCK: usize = 128;

/// The sum, by halves: its rounding grows with the logarithm of the length only (Higham 1993).
pub fn sum(x: &[f64]) -> f64 {
    if x.len() < 8 {
        return x.iter().sum();
    }
    if x.len() <= BLOCK {
        let mut lanes = [0.0; 8];
        lanes.copy_from_slice(&x[..8]);
        let chunks = x[8..].chunks_exact(8);
        let rest = chunks.remainder();
        chunks.for_each(|chunk| lanes.iter_mut().zip(chunk).for_each(|(lane, x)| *lane += x));
        let whole = ((lanes[0] + lanes[1]) + (lanes[2] + lanes[3])) + ((lanes[4] + lanes[5]) + (lanes[6] + lanes[7]));
        return rest.iter().fold(whole, |sum, x| sum + x);
    }
    let half = x.len() / 2;
    let (left, right) = x.split_at(half - half % 8);
    sum(left) + sum(right)
}

/// `count` numbers from `start` to `stop`, both among them.
pub fn linspace(start: f64, stop: f64, count: usize) -> Vec<f64> {
    let mut all = spaced(start, stop, count, count.saturating_sub(1).max(1));
    if let [.., last] = &mut all[..]
        && count > 1
    {
        *last = stop;
    }
    all
}

/// `count` numbers from `start` to `stop`, the end left out.
pub fn half_open(start: f64, stop: f64, count: usize) -> Vec<f64> {
    spaced(start, stop, count, count)
}

fn spaced(start: f64, stop: f64, count: usize, gaps: usize) -> Vec<f64> {
    let step = (stop - start) / gaps as f64;
    (0..count).map(|i| i as f64 * step + start).collect()
}

/// Rows of `n` numbers known at the increasing places `known`, read between them at the increasing places `at`; beyond the ends the rows
/// there.
pub fn interpolated(at: impl Iterator<Item = f64>, known: &[f64], rows: &[f64], n: usize) -> Vec<f64> {
    let last = known.len() - 1;
    let row = |i: usize| &rows[i * n..(i + 1) * n];
    let mut out = Vec::with_capacity(at.size_hint().0 * n);
    let mut i = 0;
    for x in at {
        while i < last && known[i + 1] <= x {
            i += 1;
        }
        if i == last || x <= known[i] {
            out.extend_from_slice(row(i));
            continue;
        }
        let (low, high) = (row(i), row(i + 1));
        out.extend((0..n).map(|k| (high[k] - low[k]) / (known[i + 1] - known[i]) * (x - known[i]) + low[k]));
    }
    out
}

/// The mean of the sizes of what is finite; 0 of nothing.
pub fn mean_size(values: impl Iterator<Item = f64>) -> f64 {
    let sizes: Vec<f64> = values.filter(|x| x.is_finite()).map(f64::abs).collect();
    if sizes.is_empty() { 0.0 } else { sum(&sizes) / sizes.len() as f64 }
}

/// The places of numbers in the order of their size, the least first; of equal ones the earlier.
#[inline(never)] // a sort is kilobytes of machine code
pub fn ascending(x: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..x.len()).collect();
    order.sort_by(|&a, &b| x[a].total_cmp(&x[b]));
    order
}

/// A number above 0 to one digit; others as they are.
pub fn to_one_digit(x: f64) -> f64 {
    if !(x > 0.0 && x.is_finite()) {
        return x;
    }
    let unit = 10f64.powf(x.log10().floor());
    (x / unit).round() * unit
}

/// A number as Python shows it: 1.0, nan, inf.
pub fn shown(x: f64) -> String {
    format!("{x:?}").to_lowercase()
}

/// A number to three digits, as C's %.3g has it.
pub fn three_digits(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return shown(x).trim_end_matches(".0").into();
    }
    let scientific = format!("{x:.2e}");
    let Some((digits, exponent)) = scientific.split_once('e') else { return scientific };
    let power: i32 = exponent.parse().unwrap_or(0);
    let trimmed =
        |text: &str| if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text.to_owned() };
    if (-4..3).contains(&power) {
        trimmed(&format!("{x:.*}", (2 - power) as usize))
    } else {
        format!("{}e{}{:02}", trimmed(digits), if power < 0 { '-' } else { '+' }, power.abs())
    }
}
