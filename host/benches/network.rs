//! dev
use jointwatch::fit::network::*;
use jointwatch::fit::polynomial::*;
use jointwatch::model::Network;
use jointwatch::motion::*;
use jointwatch::signal::filters::Filters;
use jointwatch::sim::*;
use jointwatch::study::Role;
use std::sync::atomic::AtomicBool;

fn nmse(study: &jointwatch::study::Study, m: &Motion, p: &[Vec<f64>], band: &[f64]) -> [f64; 2] {
    let mut out = [0.0; 2];
    for (i, axis) in study.axes.iter().enumerate() {
        let r = m.restoring_force(i, axis.inertia.unwrap(), axis.restoring_force);
        let (r, p) = (low_pass(&r, band), low_pass(&p[i], band));
        let mean = r.iter().sum::<f64>() / r.len() as f64;
        let s: f64 = r.iter().map(|v| (v - mean).powi(2)).sum();
        let e: f64 = r.iter().zip(&p).map(|(a, b)| (a - b).powi(2)).sum();
        out[i] = 100.0 * e / s;
    }
    out
}

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let get = |k: &str, d: f64| {
        args.iter()
            .find_map(|a| a.strip_prefix(&format!("{k}=")).map(|v| v.parse().unwrap()))
            .unwrap_or(d)
    };
    let snr = get("snr", 0.0);
    let mut ratios: Vec<[f64; 4]> = vec![];
    for seed in 1..=get("seeds", 5.0) as u64 {
        let sim = simulate(&SimulationOptions {
            seed,
            snr_db: (snr > 0.0).then_some(snr),
            quantised: get("q", 1.0) > 0.0,
            ..Default::default()
        })
        .unwrap();
        let study = sim.study;
        let (filters, motions) = if get("truth", 0.0) > 0.0 {
            let mut f = Filters::design(&study).unwrap();
            f.band = vec![1.0];
            let m: Vec<Motion> = sim
                .truth
                .iter()
                .enumerate()
                .map(|(i, t)| t.motion(i, 2000.0))
                .collect();
            (f, m)
        } else {
            let filters = Filters::design(&study).unwrap();
            let m = motions(&study, &filters).unwrap();
            (filters, m)
        };
        let (tr, va): (Vec<&Motion>, Vec<&Motion>) = motions
            .iter()
            .partition(|m| study.records[m.record].role == Role::Train);
        let st: Vec<&[f64]> = va[0].states.iter().map(Vec::as_slice).collect();
        let mut poly = vec![];
        for method in [Method::LeastSquares, Method::Ridge] {
            let f = fit_polynomial(
                &study.axes,
                &tr,
                &filters.band,
                &PolynomialOptions {
                    orders: None,
                    method,
                },
                &|_| (),
            )
            .unwrap();
            poly.push(nmse(
                &study,
                va[0],
                &f.polynomial.predict(&st).unwrap(),
                &filters.band,
            ));
        }
        let options = NetworkOptions {
            tolerance: get("tol", 2e-3),
            restarts: get("restarts", 5.0) as usize,
            steps_per_stage: get("steps", 60.0) as usize,
            ..Default::default()
        };
        let stop = AtomicBool::new(false);
        let fit = fit_network(
            &study.axes,
            &tr,
            &filters.band,
            &options,
            &Watch {
                progress: &|_| (),
                stop: &stop,
            },
        )
        .unwrap();
        let err = |n: &Network| nmse(&study, va[0], &n.predict(&st).unwrap(), &filters.band);
        println!(
            "seed {seed}: plain {:.2?} ridge {:.2?} rows {} band {:.0}",
            poly[0], poly[1], fit.rows, filters.band_hz
        );
        for (i, r) in fit.restarts.iter().enumerate() {
            let e = err(&r.network);
            let reach = r.trace.iter().find(|t| {
                let e = err(&t.network);
                (0..2).all(|k| e[k] * 16.0 <= poly[0][k])
            });
            println!(
                "  {}{i} cpu {:.2} steps {} {:?} γ {:.0} ev {:.0} α {:.1e} β {:.1e} train {:.3?} valid {:.3?} reach16 {:.2?}",
                if i == fit.best { "*" } else { " " },
                r.cpu_s,
                r.trace.len(),
                r.stop,
                r.effective_parameters,
                r.log_evidence,
                r.alpha,
                r.beta,
                r.training_nmse_percent,
                e,
                reach.map(|t| t.cpu_s)
            );
            if get("trace", 0.0) > 0.0 && i == fit.best {
                for t in &r.trace {
                    println!(
                        "     {:.3} rows {} train {:.3?} valid {:.3?}",
                        t.cpu_s,
                        t.rows,
                        t.training_nmse_percent,
                        err(&t.network)
                    );
                }
            }
        }
        let e = err(&fit.network);
        ratios.push([
            poly[0][0] / e[0],
            poly[0][1] / e[1],
            poly[1][0] / e[0],
            poly[1][1] / e[1],
        ]);
        println!("  ratio {:.1?}", ratios.last().unwrap());
    }
    for k in 0..4 {
        let mut v: Vec<f64> = ratios.iter().map(|r| r[k]).collect();
        v.sort_by(f64::total_cmp);
        println!("{k}: median {:.1} least {:.1}", v[v.len() / 2], v[0]);
    }
}
