use sdg_simulation::table_camera::TableCamera;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let mut c = TableCamera::open(&args[1]).unwrap();
    println!("{:?}", c.posed_camera());
    let start = std::time::Instant::now();
    let n: usize = args[2].parse().unwrap();
    for i in 0..n {
        let v = c.next_view().unwrap().unwrap();
        if i % (n / 2).max(1) == 0 {
            v.picture.save(format!("/tmp/wt/out/f{i}.png")).unwrap();
            for t in &v.truths {
                println!("{:?} {:?} {}", t.grasp.line, t.grasp.tcp, t.is_shown);
            }
        }
    }
    println!("{:.1} ms a frame", 1e3 * start.elapsed().as_secs_f64() / n as f64);
}
