#![allow(missing_docs)]
use _core::linalg::orthogonal::Orthogonal;
use std::hint::black_box;
use std::time::Instant;
fn time<T>(name: &str, mut f: impl FnMut(usize) -> T) {
    let n = 2_000_000;
    for i in 0..n / 10 { black_box(f(i)); }
    let t = Instant::now();
    for i in 0..n { black_box(f(i)); }
    println!("{name:40} {:.1} ns", t.elapsed().as_nanos() as f64 / n as f64);
}
fn main() {
    let mats: Vec<[[f64;6];6]> = (0..256).map(|s| std::array::from_fn(|i| std::array::from_fn(|j| (((s*37+i*6+j) as f64)*12.9898).sin()))).collect();
    time("copy", |i| mats[i & 255]);
    time("mgs", |i| Orthogonal::<6>::new(&mats[i & 255], 6, 6));
    time("mgs p", |i| Orthogonal::<6>::new(&mats[i & 255], 6, 6).pseudo_inverse());
    time("nalgebra lu inverse", |i| { let m = &mats[i & 255]; nalgebra::SMatrix::<f64,6,6>::from_fn(|r,c| m[r][c]).try_inverse() });
    time("nalgebra qr", |i| { let m = &mats[i & 255]; nalgebra::SMatrix::<f64,6,6>::from_fn(|r,c| m[r][c]).qr() });
    let q: Vec<f64> = (0..256).map(|i| i as f64*0.1-12.0).collect();
    time("6 sincos fast", |i| _core::linalg::trig::sin_cos::<6>(&q[(i & 127)..(i&127)+6], 6));
    time("6 sincos", |i| { let mut s=0.0; for j in 0..6 { let (a,b)=q[(i+j)&255].sin_cos(); s+=a*b;} s });
}
