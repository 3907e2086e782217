//! Runs cases, catches what they must not do, and makes bad numbers.

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Write as _;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering::Relaxed};
use std::time::{Duration, Instant};

use rkpm::geometry::Point;

/// The largest single allocation that any case may ask for: inputs are small, and so is what they ask for.
const MEMORY: usize = 512 << 20;
/// A case that takes longer ends the process: it hangs. Most take microseconds, a region graded to thousands of particles of order 3
/// takes 3 s, and 15 s on a machine that others use.
const TIME: Duration = Duration::from_secs(90);

static LARGEST: AtomicUsize = AtomicUsize::new(0);
/// Case that runs, and since when (milliseconds).
static CASE: AtomicU64 = AtomicU64::new(u64::MAX);
static SINCE: AtomicU64 = AtomicU64::new(0);
static CLASS: Mutex<&str> = Mutex::new("");
/// What the case that runs was given.
static NOTE: Mutex<String> = Mutex::new(String::new());
static PANIC: Mutex<String> = Mutex::new(String::new());

/// The system's allocator, watched.
struct Watched;

#[global_allocator]
static ALLOCATOR: Watched = Watched;

// SAFETY: hands everything on to the system's allocator.
unsafe impl GlobalAlloc for Watched {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        LARGEST.fetch_max(layout.size(), Relaxed);
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        LARGEST.fetch_max(layout.size(), Relaxed);
        unsafe { System.alloc_zeroed(layout) }
    }
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        LARGEST.fetch_max(size, Relaxed);
        unsafe { System.realloc(pointer, layout, size) }
    }
}

/// All classes of one run.
pub struct Fuzz {
    clock: Instant,
    cases: usize,
    factor: usize,
    failures: Vec<String>,
}

impl Fuzz {
    pub fn new() -> Self {
        std::panic::set_hook(Box::new(|info| {
            if let Ok(mut panic) = PANIC.lock() {
                // The line of the crate that is to blame, not that of the standard library.
                let trace = std::backtrace::Backtrace::force_capture().to_string();
                let ours = trace.lines().map(str::trim).filter(|line| line.contains("rkpm::") || line.contains("src/"));
                let ours: Vec<&str> = ours.filter(|line| !line.contains("/rustc/")).take(4).collect();
                *panic = format!("{}: {}", ours.join(" "), info.to_string().replace('\n', " "));
            }
        }));
        let clock = Instant::now();
        std::thread::spawn(move || {
            loop {
                std::thread::sleep(Duration::from_millis(500));
                let case = CASE.load(Relaxed);
                let age = (clock.elapsed().as_millis() as u64).saturating_sub(SINCE.load(Relaxed));
                if case != u64::MAX && age > TIME.as_millis() as u64 {
                    let class = CLASS.lock().map_or("?", |class| *class);
                    let note = NOTE.lock().map_or_else(|_| String::new(), |note| note.clone());
                    let _ = writeln!(std::io::stderr(), "{class}, case {case}: hangs\n    {note}");
                    std::process::abort();
                }
            }
        });
        let given = std::env::var("FUZZ_CASES");
        let factor = given.map_or(1, |n| n.parse().expect("FUZZ_CASES is a number of times"));
        Fuzz { clock, cases: 0, factor, failures: Vec::new() }
    }

    /// Runs the cases of a class; `case` notes its input before it uses it.
    pub fn class(&mut self, class: &'static str, cases: usize, case: fn(&mut Input)) {
        if let Ok(only) = std::env::var("FUZZ_CLASS")
            && !class.contains(&only)
        {
            return;
        }
        *CLASS.lock().unwrap() = class;
        let started = Instant::now();
        let mut slowest = (Duration::ZERO, 0);
        let mut passed = 0;
        // A few of each kind tell as much as thousands.
        let mut found: Vec<(String, usize)> = Vec::new();
        for number in 0..cases * self.factor {
            let mut input = Input::new(class, number as u64);
            LARGEST.store(0, Relaxed);
            SINCE.store(self.clock.elapsed().as_millis() as u64, Relaxed);
            CASE.store(number as u64, Relaxed);
            let begun = Instant::now();
            let outcome = catch_unwind(AssertUnwindSafe(|| case(&mut input)));
            let took = begun.elapsed();
            passed += usize::from(input.passed);
            CASE.store(u64::MAX, Relaxed);
            if took > slowest.0 {
                slowest = (took, number);
            }
            let largest = LARGEST.load(Relaxed);
            let fault = if outcome.is_err() {
                PANIC.lock().map_or_else(|_| String::from("panics"), |panic| panic.clone())
            } else if largest > MEMORY {
                format!("asks for {} MB at once", largest >> 20)
            } else {
                continue;
            };
            // Panics by place, without the numbers they mention.
            let kind: String = fault.chars().take(90).collect();
            match found.iter_mut().find(|f| f.0 == kind) {
                Some(known) => known.1 += 1,
                None => {
                    found.push((kind, 1));
                    let note: String = input.note.chars().take(1500).collect();
                    self.failures.push(format!("{class}, case {number}: {fault}\n    {note}"));
                }
            }
        }
        self.cases += cases * self.factor;
        println!(
            "{class}: {} cases, {passed} to the end, in {:.1?}, slowest {:.0?} (case {})",
            cases * self.factor,
            started.elapsed(),
            slowest.0,
            slowest.1
        );
        // A class whose cases are all refused at the door looks at nothing behind it.
        let cases = cases * self.factor;
        assert!(20 * passed > cases, "{class}: {passed} of {cases} cases get to the end");
        for (kind, count) in found {
            println!("    {count} times: {kind}");
        }
    }

    pub fn finish(self, least: usize) {
        let _ = std::panic::take_hook();
        println!("{} cases in {:.1?}", self.cases, self.clock.elapsed());
        assert!(self.failures.is_empty(), "{} kinds of failure\n{}", self.failures.len(), self.failures.join("\n"));
        let least = if std::env::var("FUZZ_CLASS").is_ok() { 1 } else { least };
        assert!(self.cases >= least, "{} cases", self.cases);
    }
}

/// Random numbers of a case, and what it was given.
pub struct Input {
    pub random: fastrand::Rng,
    pub note: String,
    /// Whether the case got past all refusals.
    pub passed: bool,
}

impl Input {
    fn new(class: &str, number: u64) -> Self {
        let seed =
            class.bytes().fold(number.wrapping_mul(0x9e37_79b9_7f4a_7c15), |s, b| s.rotate_left(7) ^ u64::from(b));
        Input { random: fastrand::Rng::with_seed(seed), note: String::new(), passed: false }
    }

    /// Remembers what the case is given, for its failure.
    pub fn saw<T: std::fmt::Debug>(&mut self, what: &str, value: T) -> T {
        use std::fmt::Write as _;
        if self.note.len() < 4000 {
            let _ = write!(self.note, "{what} = {value:?}; ");
            if let Ok(mut note) = NOTE.lock() {
                note.clone_from(&self.note);
            }
        }
        value
    }

    /// `true` once in `n` times.
    pub fn once_in(&mut self, n: usize) -> bool {
        self.random.usize(0..n) == 0
    }

    /// A number that nobody wants.
    pub fn bad(&mut self) -> f64 {
        let bad = [
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            0.0,
            -0.0,
            -1.0,
            1e300,
            -1e300,
            1e-300,
            f64::MAX,
            f64::MIN,
            f64::MIN_POSITIVE,
            5e-324,
            f64::EPSILON,
            1e16,
            -1e-16,
            1e150,
            1e-150,
        ];
        if self.once_in(8) { f64::from_bits(self.random.u64(..)) } else { bad[self.random.usize(0..bad.len())] }
    }

    /// A number between two, or once in a while a bad one.
    pub fn number(&mut self, low: f64, high: f64) -> f64 {
        if self.once_in(12) { self.bad() } else { self.good(low, high) }
    }

    pub fn good(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.random.f64()
    }

    pub fn numbers(&mut self, count: usize, low: f64, high: f64) -> Vec<f64> {
        // Mostly sound throughout, so that deeper code is reached.
        let spoilt = self.once_in(3);
        (0..count).map(|_| if spoilt { self.number(low, high) } else { self.good(low, high) }).collect()
    }

    pub fn point<const D: usize>(&mut self, low: f64, high: f64) -> Point<D> {
        Point::from_fn(|_, _| self.number(low, high))
    }

    pub fn good_point<const D: usize>(&mut self, low: f64, high: f64) -> Point<D> {
        Point::from_fn(|_, _| self.good(low, high))
    }

    /// A count from a range, or once in a while an absurd one; none between, which would only be large.
    pub fn count(&mut self, low: usize, high: usize) -> usize {
        let absurd =
            [0, 0, 1, 1 << 40, usize::MAX, usize::MAX / 2, u32::MAX as usize, 1_000_000_000, i64::MAX as usize];
        if self.once_in(10) { absurd[self.random.usize(0..absurd.len())] } else { self.random.usize(low..=high) }
    }

    /// A length that is as it should be, or once in a while another.
    pub fn length(&mut self, right: usize) -> usize {
        match self.random.usize(0..14) {
            0 => 0,
            1 => right.saturating_sub(1),
            2 => right + 1,
            3 => right + 7,
            _ => right,
        }
    }

    /// An index below a bound, or once in a while one beyond.
    pub fn index(&mut self, bound: usize) -> usize {
        if bound == 0 || self.once_in(12) {
            [bound, bound + 1, usize::MAX, u32::MAX as usize][self.random.usize(0..4)]
        } else {
            self.random.usize(0..bound)
        }
    }

    pub fn pick<T: Clone>(&mut self, from: &[T]) -> T {
        from[self.random.usize(0..from.len())].clone()
    }
}
