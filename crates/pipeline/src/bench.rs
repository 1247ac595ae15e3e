//! Where the stages are done: each once, watched, measured and recorded.

use crate::meter::Meter;
use crate::store::{Store, key};
use crate::{Options, RunError, Stage};
use serde::{Serialize, de::DeserializeOwned};
use std::io::Write;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};
use supine_report::{StageTime, Warning};
use supine_space::Progress;

/// Sees a run from outside, and may stop it.
pub trait Watch: Sync {
    /// A stage begins.
    fn begin(&self, stage: Stage);
    /// Share of a stage done, 0..=1; false stops the run.
    fn progress(&self, stage: Stage, share: f64) -> bool;
    /// Something the user must know.
    fn warning(&self, stage: Stage, message: &str);
    /// A stage is done; `cached` when it was done before.
    fn end(&self, stage: Stage, seconds: f64, cached: bool);
}

/// The state of one run.
pub(crate) struct Bench<'a> {
    pub(crate) store: Store,
    watch: &'a dyn Watch,
    program: String,
    pub(crate) times: Vec<StageTime>,
    pub(crate) warnings: Vec<Warning>,
}

/// What a stage made.
pub(crate) struct Made<P, F> {
    pub(crate) product: P,
    pub(crate) facts: F,
    pub(crate) warnings: Vec<String>,
}

/// A stage's product with the key that names it.
#[derive(Debug)]
pub(crate) struct Done<P, F> {
    pub(crate) product: P,
    pub(crate) facts: F,
    pub(crate) key: String,
}

impl<'a> Bench<'a> {
    pub(crate) fn open(
        out: &Path,
        options: Options,
        watch: &'a dyn Watch,
    ) -> Result<Self, RunError> {
        let store = Store::open(out, options.force)?;
        let program = program_hash();
        Ok(Self { store, watch, program, times: Vec::new(), warnings: Vec::new() })
    }

    /// Does a stage that leaves nothing on disk.
    pub(crate) fn pass<P>(
        &mut self,
        stage: Stage,
        work: impl FnOnce(Progress<'_>) -> Result<(P, Vec<String>), RunError>,
    ) -> Result<P, RunError> {
        let watch = self.watch;
        let meter = self.begin(stage);
        let (product, warnings) = work(Progress::new(&|share| watch.progress(stage, share)))?;
        self.end(meter, stage, false, warnings)?;
        Ok(product)
    }

    /// Does a stage, or loads what it left for the same inputs.
    ///
    /// `inputs` are the keys and parameters that decide the product; `make` writes it to the
    /// store and `load` reads it back.
    pub(crate) fn stage<P, F: Serialize + DeserializeOwned>(
        &mut self,
        stage: Stage,
        inputs: &[&str],
        load: impl FnOnce(&Store, Progress<'_>) -> Result<P, RunError>,
        make: impl FnOnce(&Store, Progress<'_>) -> Result<Made<P, F>, RunError>,
    ) -> Result<Done<P, F>, RunError> {
        let watch = self.watch;
        let meter = self.begin(stage);
        let key = key(&[&[self.program.as_str(), stage.name()], inputs].concat());
        let progress = |share| watch.progress(stage, share);
        let progress = Progress::new(&progress);
        if let Some(record) = self.store.done::<F>(stage, &key) {
            let product = load(&self.store, progress)?;
            self.end(meter, stage, true, record.warnings)?;
            return Ok(Done { product, facts: record.facts, key });
        }
        self.store.clear_from(stage)?;
        let made = make(&self.store, progress)?;
        let record = self.store.keep(stage, &key, made.facts, made.warnings)?;
        self.end(meter, stage, false, record.warnings)?;
        Ok(Done { product: made.product, facts: record.facts, key })
    }

    fn begin(&self, stage: Stage) -> Meter {
        self.watch.begin(stage);
        Meter::start(stage)
    }

    fn end(
        &mut self,
        meter: Meter,
        stage: Stage,
        cached: bool,
        warnings: Vec<String>,
    ) -> Result<(), RunError> {
        let time = meter.stop(cached);
        self.watch.end(stage, time.seconds, cached);
        for message in &warnings {
            self.watch.warning(stage, message);
        }
        self.log(&time, &warnings)?;
        self.times.push(time);
        let named = |message| Warning { stage: stage.name().into(), message };
        self.warnings.extend(warnings.into_iter().map(named));
        Ok(())
    }

    /// Appends a line to `log.jsonl`.
    fn log(&self, time: &StageTime, warnings: &[String]) -> Result<(), RunError> {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let line = serde_json::json!({
            "unix_seconds": now.as_secs(), "stage": time, "warnings": warnings,
        });
        let path = self.store.path("log.jsonl")?;
        let output = |source| RunError::Output { path: path.clone(), source };
        let mut file =
            std::fs::OpenOptions::new().create(true).append(true).open(&path).map_err(output)?;
        writeln!(file, "{line}").map_err(output)
    }
}

/// What made the products: the hash of this program, so that no version trusts another's cache.
fn program_hash() -> String {
    let program = std::env::current_exe().and_then(|exe| crate::store::hash_of(&exe));
    program.map_or_else(|_| env!("CARGO_PKG_VERSION").into(), |hashed| hashed.blake3)
}
