//! Estimates of many seeds against the truth and the bound.

/// One estimate of one number, relative to the truth: error and standard error.
#[derive(Debug, Clone, Copy)]
pub struct Outcome {
    pub error: f64,
    pub std: f64,
}

/// Prints one row per number: rms error, ratio to the bound, bias in standard deviations, coverage.
pub fn print(title: &str, outcomes: &[Vec<Outcome>], bound: &[f64]) {
    let seeds = outcomes.len();
    println!("\n{title}: {seeds} seeds; ratios scatter by {:.0} %", 100.0 / (2.0 * seeds as f64).sqrt());
    println!("       rms error    bound        rms/bound  std/bound  bias/rms  covered");
    let mut all = 0;
    for (p, bound) in bound.iter().enumerate() {
        let each = || outcomes.iter().map(|o| o[p]);
        let n = seeds as f64;
        let rms = (each().map(|o| o.error * o.error).sum::<f64>() / n).sqrt();
        let bias = each().map(|o| o.error).sum::<f64>() / n;
        let std = (each().map(|o| o.std * o.std).sum::<f64>() / n).sqrt();
        let covered = each().filter(|o| o.error.abs() <= 1.96 * o.std).count();
        all += covered;
        let (unit, scale, name) = if p % 2 == 0 { ("ppm", 1e6, "f") } else { ("%  ", 1e2, "Q") };
        println!(
            "  {name}{}  {:9.4} {unit}  {:8.4} {unit}  {:8.3}  {:9.3}  {:+8.2}  {covered}/{seeds}",
            p / 2 + 1,
            rms * scale,
            bound * scale,
            rms / bound,
            std / bound,
            bias / rms
        );
    }
    println!("  95 % intervals cover {:.1} % of all", 100.0 * all as f64 / (seeds * bound.len()) as f64);
}
