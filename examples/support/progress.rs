//! A bar that follows the load factor; Ctrl-C ends the run after the iteration under way and keeps its path.

use std::ops::ControlFlow;
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::{ProgressBar, ProgressStyle};
use rkpm::solve::{Iteration, Observer, Step};

static STOP: AtomicBool = AtomicBool::new(false);
static LISTEN: Once = Once::new();

/// Shows the load factor, steps and iterations of a run.
pub struct Progress {
    bar: ProgressBar,
    steps: usize,
    iterations: usize,
}

impl Progress {
    pub fn new() -> Self {
        LISTEN.call_once(|| {
            // Without a handler Ctrl-C ends the program as ever.
            let _ = ctrlc::set_handler(|| STOP.store(true, Ordering::Relaxed));
        });
        let style = ProgressStyle::with_template("{bar:30} {msg}").unwrap_or_else(|_| ProgressStyle::default_bar());
        Progress { bar: ProgressBar::new(1000).with_style(style), steps: 0, iterations: 0 }
    }
}

impl Observer for Progress {
    fn iteration(&mut self, iteration: &Iteration) -> ControlFlow<()> {
        self.iterations += 1;
        self.bar.set_message(format!(
            "load {:.3}, step {}, iteration {}, increment {:.1e}",
            iteration.load,
            self.steps + 1,
            self.iterations,
            iteration.increment
        ));
        if STOP.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn step(&mut self, step: &Step) -> ControlFlow<()> {
        self.steps += 1;
        self.bar.set_position((1000.0 * step.state.load) as u64);
        if step.state.load >= 1.0 {
            self.bar.finish_and_clear();
        }
        if STOP.load(Ordering::Relaxed) {
            self.bar.abandon_with_message(format!("stopped at load {:.3}; the path so far is kept", step.state.load));
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    }
}
