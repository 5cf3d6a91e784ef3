//! Recorders on threads of their own: a run goes on while its samples are written.
//!
//! Each recorder has a thread and a bounded queue of batches of samples, which all recorders share.
//! Every recorder sees the same samples in the same order as without threads, so its file has the
//! same bytes. Start at [`Threads::record`].
//!
//! A batch is handed over when it is full or when the last one is [`PAUSE`] old, so that a slow run
//! keeps nothing back. When a queue is full the run waits: memory stays what it is, however long
//! the run. On a disk that is nearly full it waits for each batch: then no file takes the room that
//! another needs to reach as far.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::create::{folder_of, is_scarce};
use crate::{LogError, Recorder, RunResult, Sample};

/// Samples of a batch.
const BATCH: usize = 64;
/// Batches that wait for a recorder.
const QUEUE: usize = 4;
/// Batches that are made: those that wait, one that is being written, one that is being filled.
const BATCHES: usize = QUEUE + 2;
/// Longest time between two batches while samples come.
const PAUSE: Duration = Duration::from_millis(20);
/// Time between two looks at how much room the disk has.
const LOOK: Duration = Duration::from_millis(200);

/// Some samples in a row.
#[derive(Default)]
struct Batch {
    samples: Vec<Sample>,
    /// How many of them count; the rest is memory to be used again.
    used: usize,
}

enum Message {
    Samples(Arc<Batch>),
    /// To be answered when all before it is written.
    Reach(SyncSender<()>),
    Finish(Arc<RunResult>),
}

/// A recorder on its thread.
struct Worker {
    queue: SyncSender<Message>,
    thread: JoinHandle<(Box<dyn Recorder>, Result<(), LogError>)>,
    /// The first error of `record`, until it is told.
    failed: Arc<Mutex<Option<LogError>>>,
}

/// Recorders that have begun, each on its thread. Dropped without [`Threads::finish`], the files
/// close themselves as well as they can, and the threads are over.
pub(crate) struct Threads {
    workers: Vec<Worker>,
    /// The one that is being filled comes first, then the oldest.
    batches: VecDeque<Arc<Batch>>,
    handed_over: Instant,
    /// Folder of the first file, whether its disk is nearly full, and when that was seen.
    folder: PathBuf,
    scarce: bool,
    looked: Instant,
    /// The result is handed over.
    closed: bool,
}

impl Threads {
    /// Starts a thread for each recorder.
    pub(crate) fn start(recorders: Vec<Box<dyn Recorder>>) -> Self {
        let start = |recorder: Box<dyn Recorder>| {
            let (queue, received) = sync_channel(QUEUE);
            let failed = Arc::new(Mutex::new(None));
            let slot = failed.clone();
            // Profilers tell threads by their names.
            let name = recorder.path().extension().map_or_else(Default::default, |e| e.to_string_lossy().into_owned());
            let begin = move || write(recorder, &received, &slot);
            let thread = std::thread::Builder::new().name(name).spawn(begin).expect("the system starts a few threads");
            Worker { queue, thread, failed }
        };
        let batches = (0..BATCHES).map(|_| Arc::default()).collect();
        let folder = folder_of(recorders.first().map_or(Path::new(""), |recorder| recorder.path())).to_owned();
        let (scarce, now) = (is_scarce(&folder), Instant::now());
        let workers = recorders.into_iter().map(start).collect();
        Self { workers, batches, handed_over: now, folder, scarce, looked: now, closed: false }
    }

    /// Adds one instant.
    ///
    /// # Errors
    /// The first error of a recorder that has not been told yet; it may belong to an earlier
    /// sample.
    pub(crate) fn record(&mut self, sample: &Sample) -> Result<(), LogError> {
        let current = &mut self.batches[0];
        // Nobody else has this one any more: each queue is shorter than the ring. Should one be
        // late, it keeps its own.
        if Arc::get_mut(current).is_none() {
            *current = Arc::default();
        }
        if let Some(batch) = Arc::get_mut(current) {
            match batch.samples.get_mut(batch.used) {
                Some(free) => free.clone_from(sample),
                None => batch.samples.push(sample.clone()),
            }
            batch.used += 1;
            if batch.used == BATCH || self.handed_over.elapsed() >= PAUSE {
                self.hand_over();
            }
        }
        self.untold().map_or(Ok(()), Err)
    }

    /// Gives the batch to all recorders and begins the next.
    fn hand_over(&mut self) {
        if self.batches[0].used == 0 {
            return;
        }
        for worker in &self.workers {
            // A thread that has ended says why when it is joined.
            let _ = worker.queue.send(Message::Samples(self.batches[0].clone()));
        }
        self.handed_over = Instant::now();
        if self.handed_over - self.looked >= LOOK {
            (self.scarce, self.looked) = (is_scarce(&self.folder), self.handed_over);
        }
        if self.scarce {
            self.wait();
        }
        self.batches.rotate_left(1);
        if let Some(next) = Arc::get_mut(&mut self.batches[0]) {
            next.used = 0;
        }
    }

    /// Until all recorders have written what they were given.
    fn wait(&self) {
        let (reached, all) = sync_channel(self.workers.len());
        for worker in &self.workers {
            let _ = worker.queue.send(Message::Reach(reached.clone()));
        }
        drop(reached);
        // Ends when nobody can answer any more.
        all.iter().for_each(drop);
    }

    /// Hands over what waits and the result, once.
    pub(crate) fn close(&mut self, result: &RunResult) {
        if std::mem::replace(&mut self.closed, true) {
            return;
        }
        self.hand_over();
        let result = Arc::new(result.clone());
        for worker in &self.workers {
            let _ = worker.queue.send(Message::Finish(result.clone()));
        }
    }

    /// Until all is written, and the result ([`Threads::close`]); the recorders again, and what
    /// went wrong first.
    ///
    /// # Panics
    /// If a recorder did.
    pub(crate) fn finish(mut self, result: &RunResult) -> (Vec<Box<dyn Recorder>>, Result<(), LogError>) {
        self.close(result);
        let (mut recorders, mut outcome) = (Vec::new(), Ok(()));
        for Worker { queue, thread, failed } in std::mem::take(&mut self.workers) {
            drop(queue);
            let (recorder, finished) = thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            recorders.push(recorder);
            let late = failed.lock().unwrap_or_else(PoisonError::into_inner).take();
            outcome = outcome.and(late.map_or(Ok(()), Err)).and(finished);
        }
        (recorders, outcome)
    }

    /// The first error that is not told yet.
    fn untold(&self) -> Option<LogError> {
        self.workers.iter().find_map(|worker| worker.failed.lock().unwrap_or_else(PoisonError::into_inner).take())
    }
}

impl Drop for Threads {
    fn drop(&mut self) {
        if self.workers.is_empty() {
            return;
        }
        self.hand_over();
        for Worker { queue, thread, .. } in self.workers.drain(..) {
            drop(queue);
            let _ = thread.join(); // the recorder is dropped here and closes its file
        }
    }
}

/// What a thread does: writes samples until there are no more, or until that fails, then the
/// result.
fn write(
    mut recorder: Box<dyn Recorder>,
    received: &Receiver<Message>,
    failed: &Mutex<Option<LogError>>,
) -> (Box<dyn Recorder>, Result<(), LogError>) {
    let mut writes = true;
    while let Ok(message) = received.recv() {
        match message {
            Message::Samples(batch) if writes => {
                if let Err(error) = recorder.record_all(&batch.samples[..batch.used]) {
                    writes = false;
                    *failed.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
                }
            }
            Message::Samples(_) => {}
            Message::Reach(reached) => {
                let _ = reached.send(());
            }
            Message::Finish(result) => {
                let finished = recorder.finish(&result);
                return (recorder, finished);
            }
        }
    }
    (recorder, Ok(()))
}
