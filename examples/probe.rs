//! probe
use std::sync::atomic::AtomicBool;
use std::time::Instant;
struct S;
impl vibrissa::sweep::Progress for S {
    fn at(&mut self, _: u64, _: u64) {}
}
fn main() {
    let n: u32 = std::env::args().nth(1).map_or(60, |s| s.parse().unwrap());
    let seed: u64 = std::env::args().nth(2).map_or(1, |s| s.parse().unwrap());
    let t = Instant::now();
    let cases = vibrissa::verify::Case::built_in(n, seed).unwrap();
    println!("cases {:?}", t.elapsed());
    let t = Instant::now();
    let mut places = vibrissa::verify::present(&Default::default(), None).unwrap();
    println!("places {:?} {:?}", t.elapsed(), places.iter().map(|p| p.label()).collect::<Vec<_>>());
    let all = Instant::now();
    for c in cases {
        let t = Instant::now();
        let v = vec![c];
        vibrissa::verify::run(&v, &mut [], &AtomicBool::new(false), &mut S).unwrap();
        let r = t.elapsed();
        let t = Instant::now();
        for (i, tu) in v[0].tuples.iter().enumerate() {
            let q = Instant::now();
            let one = vec![vibrissa::verify::Case {
                name: String::new(),
                scene: v[0].scene.clone(),
                tuples: vec![*tu],
            }];
            vibrissa::verify::run(&one, &mut [], &AtomicBool::new(false), &mut S).unwrap();
            if q.elapsed().as_secs_f64() > 0.3 {
                println!("   slow {i} {:?} {:?}", tu.to_array(), q.elapsed());
            }
        }
        let l = vibrissa::verify::run(&v, &mut places, &AtomicBool::new(false), &mut S).unwrap();
        println!("{} taps {} ref {:?} all {:?}", v[0].name, v[0].tuples.len(), r, t.elapsed());
        for l in l {
            let f = |k: usize| {
                l.errors[k]
                    .map_or("-".into(), |f: vibrissa::verify::Figures| format!("{:.1e}/{}", f.worst, f.over))
            };
            println!(
                "   {:9} cmp {} neither {} unsolved {} unanswered {} differ {} | {} {} {} {} | sweeps {:.1} {} | {:?} | {:?}",
                places[l.place].label(),
                l.compared,
                l.neither,
                l.unsolved,
                l.unanswered,
                l.differ,
                f(0),
                f(1),
                f(2),
                f(3),
                l.sweeps.0,
                l.sweeps.1,
                l.faults(),
                l.odd.map(|(t, e, f)| format!("{:?} ref {e} kernel {f}", t.to_array()))
            );
            if l.faults().contains(&"strain") {
                println!("        {:?}", l.at);
            }
        }
    }
    println!("total {:?}", all.elapsed());
}
