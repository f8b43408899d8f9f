//! Trial.

use vibrissa_learned::{rows::*, fit::*, base::*, invert::*, suspects::sound};
fn main() {
    let mut tot: Vec<f64> = Vec::new();
    for path in std::env::args().skip(1) {
        let text = std::fs::read_to_string(&path).unwrap();
        let mut lines = text.lines();
        let names: Vec<&str> = lines.next().unwrap().split(',').collect();
        let at = |n: &[&str]| names.iter().position(|x| n.contains(x));
        let (ia, iu, iy, ir) = (at(&["a_mm"]).unwrap(), at(&["delta_mm", "theta_deg"]), at(&["reading", "strain"]).unwrap(), at(&["run"]));
        let mut labels: Vec<String> = vec![];
        let mut rows = Vec::new();
        for (k, l) in lines.enumerate() {
            let f: Vec<&str> = l.split(',').collect();
            let run = ir.map_or(0, |i| { let s = f[i].to_string(); labels.iter().position(|x| *x == s).unwrap_or_else(|| { labels.push(s); labels.len() - 1 }) });
            rows.push(Row { a: f[ia].parse().unwrap(), u: iu.map_or(1.0, |i| f[i].parse().unwrap()), y: f[iy].parse().unwrap(), run, t: k as f64 });
        }
        // sign
        let zero: Vec<f64> = rows.iter().filter(|r| r.u == 0.0).map(|r| r.y).collect();
        let slope: f64 = if zero.is_empty() { let n = rows.len() as f64; let mu = rows.iter().map(|r| r.u).sum::<f64>()/n; let my = rows.iter().map(|r| r.y).sum::<f64>()/n; let s: f64 = rows.iter().map(|r| (r.u-mu)*(r.y-my)).sum(); if s == 0.0 { my } else { s } } else { rows.iter().filter(|r| r.u != 0.0).map(|r| r.y - zero[0]).sum() };
        let sign = slope.signum();
        rows.iter_mut().for_each(|r| r.y *= sign);
        let step = quantum(&rows.iter().map(|r| r.y).collect::<Vec<_>>());
        let task = Task { rows: &rows, known: None, step, drift: false };
        let all: Vec<usize> = (0..rows.len()).collect();
        let clock = std::time::Instant::now();
        let (f, sus) = match sound(&task, &all, true) { Ok(x) => x, Err(e) => { println!("{path} {e:?}"); continue } };
        println!("{path}: n={} cells {} step {step:.3e} {:.3} s; suspects {:?}", rows.len(), f.cells.len(), clock.elapsed().as_secs_f64(), sus.iter().map(|s| (s.place + 2, s.off / s.expected)).collect::<Vec<_>>());
        for (h, x) in f.hypers.iter().zip(&f.at) { print!(" {h:?} {:.2e}", x.exp()); }
        println!("\n  power {:?} zero {:?} spread {:?}", f.power, f.curve.zero(), f.curve.spread);
        if std::env::var("DBG").is_ok() { for t in &f.curve.terms { let [m, sd] = f.curve.coefficient(*t).unwrap(); if m.abs() > 5e-4 { println!("    {t:?} {m:.5} ± {sd:.5}"); } } }
        // groups of positions
        let mut pos: Vec<f64> = rows.iter().filter(|r| r.u != 0.0).map(|r| r.a).collect();
        pos.sort_by(f64::total_cmp);
        let mut g: Vec<Vec<f64>> = vec![];
        for a in pos { if let Some(l) = g.last_mut() && a - l[0] < 0.012 * a { l.push(a) } else { g.push(vec![a]) } }
        let group = |a: f64| g.iter().position(|l| a >= l[0] && a <= l[l.len()-1]).unwrap();
        let mut judge = |name: &str, out: &dyn Fn(&Row) -> usize, n: usize, tared: bool| {
            let (mut e2, mut k1, mut k3, mut n_, mut miss) = (0.0, 0, 0, 0, 0);
            let mut per = String::new();
            for fold in 0..n {
                let places: Vec<usize> = (0..rows.len()).filter(|k| rows[*k].u == 0.0 && name == "pos" || rows[*k].u != 0.0 && out(&rows[*k]) != fold || rows[*k].u == 0.0 && out(&rows[*k]) != fold).collect();
                let Ok((f, _)) = sound(&task, &places, true) else { println!("   fold {fold} fails"); continue };
                let power = f.power.unwrap();
                let inv = Inverse::new(&f.curve, &Base::Power(power), State { tared, same_run: name == "pos" && labels.len() < 2 }, [1.0, 1e4]);
                let zr: Vec<f64> = rows.iter().filter(|r| r.u == 0.0 && (name == "pos" || out(r) == fold)).map(|r| r.y).collect();
                let (mut f2, mut fnn) = (0.0, 0);
                for r in rows.iter().filter(|r| r.u != 0.0 && out(r) == fold) {
                    let z = if tared && !zr.is_empty() { zr.iter().sum::<f64>() / zr.len() as f64 } else { f.curve.zero };
                    match inv.at(r.u).find(r.y - z, 0.0, 0.0) {
                        Ok(x) => { let e = x.a - r.a; e2 += e * e; f2 += e*e; fnn += 1; n_ += 1; if e.abs() < x.sigma { k1 += 1 } if e.abs() > 3.0 * x.sigma { k3 += 1 } tot.push(e / x.sigma); }
                        Err(_) => { miss += 1; }
                    }
                }
                per += &format!(" {:.2}", (f2 / fnn.max(1) as f64).sqrt());
            }
            println!("  {name} tared {tared}: rms {:.3} within {:.0} % beyond {:.1} % n {n_} miss {miss} |{per}", (e2 / n_ as f64).sqrt(), 100.0 * k1 as f64 / n_ as f64, 100.0 * k3 as f64 / n_ as f64);
        };
        let tared = !zero.is_empty();
        judge("pos", &|r| if r.u == 0.0 { 999 } else { group(r.a) }, g.len(), tared);
        if labels.len() > 1 { judge("runs", &|r| r.run, labels.len(), tared); }
    }
    let n = tot.len() as f64;
    println!("all: within {:.3} beyond {:.4} n {n}", tot.iter().filter(|t| t.abs() < 1.0).count() as f64 / n, tot.iter().filter(|t| t.abs() > 3.0).count() as f64 / n);
}
