use afmid_kernels::c64;
use afmid_kernels::frf_modes::*;
fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let quantity = match args[0].as_str() {
        "a" => FrfQuantity::Accelerance,
        _ => FrfQuantity::Receptance,
    };
    let num = |s: &str| s.parse::<f64>().ok();
    let mut f = Vec::new();
    let mut rows = Vec::new();
    for file in &args[4..] {
        let text = String::from_utf8_lossy(&std::fs::read(file).unwrap()).into_owned();
        let t: Vec<Vec<f64>> = text
            .lines()
            .filter_map(|l| l.split_whitespace().map(|x| x.parse::<f64>().ok()).collect::<Option<Vec<f64>>>())
            .filter(|v| v.len() == 3)
            .collect();
        f = t.iter().map(|v| v[0]).collect();
        rows.push(t.iter().map(|v| c64::new(v[1], v[2])).collect::<Vec<_>>());
    }
    let rows: Vec<&[c64]> = rows.iter().map(|r| r.as_slice()).collect();
    let options = FrfModesOptions {
        quantity,
        from_hz: num(&args[1]),
        to_hz: num(&args[2]),
        driving_point: num(&args[3]).map(|x| x as usize),
        ..Default::default()
    };
    let t = std::time::Instant::now();
    let fit = frf_modes(MeasuredResponses { frequency_hz: &f, transfer: &rows, variance: None }, &options).unwrap();
    println!("{} s, verdict {:?} chi {}", t.elapsed().as_secs_f64(), fit.verdict, fit.reduced_chi_square);
    for t in &fit.tried {
        println!("  tried {} gain {:.3e} {}", t.modes, t.gain, t.kept);
    }
    for m in &fit.modes {
        let d = m.estimate.damping_ratio();
        println!(
            "{:.3} +- {:.3} Hz  zeta {:.4} +- {:.4} %  mpc {:.3} lack {:.2} corr {:.2}",
            m.estimate.frequency_hz.value,
            m.estimate.frequency_hz.std,
            100.0 * d.value,
            100.0 * d.std,
            m.phase_collinearity,
            m.lack_of_fit,
            m.correlation
        );
        println!(
            "   shape {}",
            m.shape
                .points
                .iter()
                .map(|p| format!("{:+.3}{:+.3}i", p.value.re, p.value.im))
                .collect::<Vec<_>>()
                .join(" ")
        );
        if let Some(n) = &m.mass_normalised {
            println!(
                "   mass-normalised {}",
                n.iter().map(|p| format!("{:+.3}({:.3})", p.value, p.std)).collect::<Vec<_>>().join(" ")
            );
        }
    }
    let e: Vec<f64> = (0..rows.len())
        .map(|r| {
            let (mut a, mut b) = (0.0, 0.0);
            for (k, ff) in f.iter().enumerate() {
                if fit.frequency_hz.binary_search_by(|x| x.total_cmp(ff)).is_ok() {
                    let m = fit.model.at(*ff)[r];
                    a += (rows[r][k] - m).norm_sqr();
                    b += rows[r][k].norm_sqr();
                }
            }
            100.0 * (1.0 - (a / b).sqrt())
        })
        .collect();
    println!("fit % {:.1?}", e);
}
