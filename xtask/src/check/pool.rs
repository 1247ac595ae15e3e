//! Work side by side: as many jobs as there are processors, what holds up the end longest first.
//!
//! A job says how many processors it takes, how long it is expected to take and which jobs must
//! have passed before it. Of those that can begin, the one with the longest chain of work behind it
//! begins first; what takes long thus does not begin last. Jobs of one lane never run beside each
//! other: cargo locks its build folder.

use super::outcome::{Done, Outcome, Report};
use anyhow::Result;
use std::sync::mpsc;
use std::time::{Duration, Instant};

/// What a job has for its work.
pub(crate) struct Seat {
    /// The processors it may keep busy, by number.
    pub(crate) processors: Vec<usize>,
}

/// What a job does; its report tells what was tested.
pub(crate) type Work<'a> = Box<dyn FnOnce(&Seat) -> Result<Report> + Send + 'a>;

/// A piece of work.
pub(crate) struct Job<'a> {
    /// What people call it.
    pub(crate) name: String,
    /// The step that it is a part of.
    pub(crate) step: &'static str,
    /// How many processors it keeps busy; at most all. 0: it mostly waits, and runs beside the
    /// others, one of its kind at a time.
    pub(crate) processors: usize,
    /// How long it is expected to take, s.
    pub(crate) seconds: f64,
    /// Indices of the jobs that must have passed before it, all smaller than its own.
    pub(crate) after: Vec<usize>,
    /// Whether it is cargo that compiles: one at a time.
    pub(crate) compiles: bool,
    /// What it does.
    pub(crate) work: Work<'a>,
}

/// How often somebody who watches is told that work goes on.
const SILENCE: Duration = Duration::from_secs(30);

/// The state of the jobs while they are worked off.
struct Board<'a> {
    jobs: Vec<Option<Job<'a>>>,
    /// The longest chain of expected seconds from a job to the end.
    chains: Vec<f64>,
    running: Vec<Running>,
    done: Vec<Option<Done>>,
    free: Vec<usize>,
}

struct Running {
    job: usize,
    name: String,
    compiles: bool,
    processors: Vec<usize>,
    begun: Instant,
}

/// Runs all jobs on these many processors and tells what became of each, in the order given. A job
/// whose forerunner did not pass is left out.
pub(crate) fn run(jobs: Vec<Job<'_>>, processors: usize) -> Vec<Done> {
    let mut board = Board::new(jobs, processors);
    let (tell, told) = mpsc::channel::<(usize, Result<Report>)>();
    std::thread::scope(|scope| {
        loop {
            board.leave_out();
            while let Some((index, work, seat)) = board.begin() {
                let tell = tell.clone();
                scope.spawn(move || {
                    let result = work(&seat);
                    // The other end waits for every job that was begun.
                    let _heard = tell.send((index, result));
                });
            }
            if board.running.is_empty() {
                break;
            }
            match told.recv_timeout(SILENCE) {
                Ok((index, result)) => board.end(index, result),
                Err(_) => board.say_what_runs(),
            }
        }
    });
    board.done.into_iter().flatten().collect()
}

impl<'a> Board<'a> {
    fn new(jobs: Vec<Job<'a>>, processors: usize) -> Self {
        Self {
            chains: chains(&jobs),
            done: jobs.iter().map(|_| None).collect(),
            jobs: jobs.into_iter().map(Some).collect(),
            running: Vec::new(),
            free: (0..processors).collect(),
        }
    }

    /// Takes out every job of which a forerunner did not pass.
    fn leave_out(&mut self) {
        for index in 0..self.jobs.len() {
            let failed = self.jobs[index].as_ref().is_some_and(|job| {
                job.after.iter().any(|&before| {
                    self.done[before].as_ref().is_some_and(|done| !done.outcome.passed())
                })
            });
            if failed && let Some(job) = self.jobs[index].take() {
                let done = Done::left_out(job.name, job.step);
                done.say();
                self.done[index] = Some(done);
            }
        }
    }

    /// The next job that can begin now.
    fn begin(&mut self) -> Option<(usize, Work<'a>, Seat)> {
        let compiling = self.running.iter().any(|r| r.compiles);
        let waiting = self.running.iter().any(|r| r.processors.is_empty());
        let all = self.free.len() + self.running.iter().map(|r| r.processors.len()).sum::<usize>();
        let fits = |job: &Job<'_>| {
            job.processors.min(all) <= self.free.len()
                && !(job.compiles && compiling)
                && !(job.processors == 0 && waiting)
                && job.after.iter().all(|&before| self.done[before].is_some())
        };
        let next = (0..self.jobs.len())
            .filter(|&index| self.jobs[index].as_ref().is_some_and(fits))
            .max_by(|&a, &b| self.chains[a].total_cmp(&self.chains[b]).then(b.cmp(&a)))?;
        let job = self.jobs[next].take()?;
        let processors: Vec<usize> = self.free.drain(..job.processors.min(all)).collect();
        self.running.push(Running {
            job: next,
            name: format!("{}: {}", job.step, job.name),
            compiles: job.compiles,
            processors: processors.clone(),
            begun: Instant::now(),
        });
        // Who and what stays here: the work goes to another thread.
        self.done[next] = None;
        let seat = if processors.is_empty() { (0..all).collect() } else { processors };
        Some((next, job.work, Seat { processors: seat }))
    }

    fn end(&mut self, index: usize, result: Result<Report>) {
        let Some(at) = self.running.iter().position(|r| r.job == index) else { return };
        let ended = self.running.swap_remove(at);
        self.free.extend(ended.processors);
        self.free.sort_unstable();
        let (step, name) = ended.name.split_once(": ").unwrap_or((&ended.name, ""));
        let outcome = match result {
            Ok(report) => Outcome::Ended(report),
            Err(error) => Outcome::Broken(format!("{error:#}")),
        };
        let done = Done::new(name.into(), step.into(), ended.begun.elapsed(), outcome);
        done.say();
        self.done[index] = Some(done);
    }

    fn say_what_runs(&self) {
        let each = self
            .running
            .iter()
            .map(|r| format!("{} ({:.0} s)", r.name, r.begun.elapsed().as_secs_f64()));
        println!("   … {}", each.collect::<Vec<_>>().join(", "));
    }
}

/// The longest chain of expected seconds that begins with each job.
fn chains(jobs: &[Job<'_>]) -> Vec<f64> {
    let mut chains: Vec<f64> = jobs.iter().map(|job| job.seconds).collect();
    for (index, job) in jobs.iter().enumerate().rev() {
        for &before in &job.after {
            chains[before] = chains[before].max(jobs[before].seconds + chains[index]);
        }
    }
    chains
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    type Seen = Mutex<Vec<&'static str>>;

    fn job<'a>(name: &'static str, seconds: f64, after: &[usize], seen: &'a Seen) -> Job<'a> {
        Job {
            name: name.into(),
            step: "tests",
            processors: 1,
            seconds,
            after: after.to_vec(),
            compiles: false,
            work: Box::new(move |_| {
                seen.lock().expect("no job panics").push(name);
                if name == "bad" { anyhow::bail!("as asked") } else { Ok(Report::default()) }
            }),
        }
    }

    #[test]
    fn what_holds_up_the_end_longest_begins_first() {
        let seen = Seen::default();
        let jobs = vec![
            job("short", 1.0, &[], &seen),
            job("opens the way", 2.0, &[], &seen),
            job("long", 5.0, &[], &seen),
            job("longest", 9.0, &[1], &seen),
        ];
        run(jobs, 1);
        let order = seen.into_inner().expect("no job panicked");
        assert_eq!(order, ["opens the way", "longest", "long", "short"]);
    }

    #[test]
    fn what_follows_a_failure_is_left_out_and_all_else_is_done() {
        let seen = Seen::default();
        let jobs = vec![
            job("bad", 1.0, &[], &seen),
            job("after", 1.0, &[0], &seen),
            job("after that", 1.0, &[1], &seen),
            job("beside", 1.0, &[], &seen),
        ];
        let done = run(jobs, 2);
        let passed: Vec<bool> = done.iter().map(|d| d.outcome.passed()).collect();
        assert_eq!(passed, [false, false, false, true]);
        assert_eq!(seen.into_inner().expect("no job panicked").len(), 2);
    }

    #[test]
    fn what_waits_runs_beside_the_others_and_one_at_a_time() {
        let (waiting, working) = (Mutex::new(()), std::sync::Barrier::new(2));
        let wait = |name: &str, meets: bool| {
            let (waiting, working) = (&waiting, &working);
            Job {
                name: name.into(),
                step: "tests",
                processors: 0,
                seconds: if meets { 9.0 } else { 1.0 },
                after: vec![],
                compiles: false,
                work: Box::new(move |seat: &Seat| {
                    let _alone = waiting.try_lock().expect("nothing else waits");
                    if meets {
                        working.wait();
                    }
                    assert_eq!(seat.processors, [0]);
                    Ok(Report::default())
                }),
            }
        };
        let work = Job {
            name: "works".into(),
            processors: 1,
            work: Box::new(|_| {
                working.wait();
                Ok(Report::default())
            }),
            ..wait("", false)
        };
        let done = run(vec![work, wait("a", true), wait("b", false)], 1);
        assert!(done.iter().all(|d| d.outcome.passed()) && done.len() == 3);
    }

    #[test]
    fn two_that_compile_never_run_at_once() {
        let busy = Mutex::new(());
        let compile = |name: &str| Job {
            name: name.into(),
            step: "lints",
            processors: 1,
            seconds: 1.0,
            after: vec![],
            compiles: true,
            work: Box::new(|_| {
                let _held = busy.try_lock().expect("nothing else compiles");
                std::thread::yield_now();
                Ok(Report::default())
            }),
        };
        let done = run(vec![compile("a"), compile("b"), compile("c")], 3);
        assert!(done.iter().all(|d| d.outcome.passed()));
    }
}
