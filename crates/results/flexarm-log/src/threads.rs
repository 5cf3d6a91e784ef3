//! Recorders on threads of their own: the simulation goes on while its samples are written.
//!
//! Each recorder has a thread and a bounded queue of batches of samples, which all recorders share.
//! Every recorder gets the same samples in the same order as without threads, so its file has the
//! same bytes. Start at [`Threads::record`].
//!
//! A batch is sent when it is full or when [`PAUSE`] has passed since the last one, so that samples
//! of a slow run are not delayed. When a queue is full the run waits, so memory is bounded
//! regardless of the length of the run. On a nearly full disk it waits for each batch: then no file
//! takes the space that another needs for the same samples.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::create::{folder_of, is_scarce};
use crate::{LogError, Recorder, RunResult, Sample};

/// Maximum number of samples in a batch.
const BATCH: usize = 64;
/// Maximum number of batches waiting for a recorder.
const QUEUE: usize = 4;
/// Number of batches in the ring: those waiting, one being written, one being filled.
const BATCHES: usize = QUEUE + 2;
/// Maximum time between two batches while samples arrive.
const PAUSE: Duration = Duration::from_millis(20);
/// Time between two checks of the free disk space.
const POLL_INTERVAL: Duration = Duration::from_millis(200);

/// Consecutive samples.
#[derive(Default)]
struct Batch {
    samples: Vec<Sample>,
    /// Number of valid samples; the others are buffers to be reused.
    used: usize,
}

enum Message {
    Samples(Arc<Batch>),
    /// Request for an answer once all earlier messages are processed.
    Reach(SyncSender<()>),
    Finish(Arc<RunResult>),
}

/// A recorder on its thread.
struct Worker {
    queue: SyncSender<Message>,
    thread: JoinHandle<(Box<dyn Recorder>, Result<(), LogError>)>,
    /// First error of `record` until it is returned.
    failed: Arc<Mutex<Option<LogError>>>,
}

/// Recorders that have begun, each on its thread. Dropped without [`Threads::finish`], the files
/// are closed as far as possible, and the threads end.
pub(crate) struct Threads {
    workers: Vec<Worker>,
    /// Ring of batches: first the one being filled, then the oldest.
    batches: VecDeque<Arc<Batch>>,
    sent: Instant,
    /// Folder of the first file, whether its disk is nearly full, and time of that check.
    folder: PathBuf,
    scarce: bool,
    checked: Instant,
    /// Whether the result has been sent.
    closed: bool,
}

impl Threads {
    /// Starts a thread for each recorder.
    pub(crate) fn start(recorders: Vec<Box<dyn Recorder>>) -> Self {
        let start = |recorder: Box<dyn Recorder>| {
            let (queue, received) = sync_channel(QUEUE);
            let failed = Arc::new(Mutex::new(None));
            let slot = failed.clone();
            // Name the thread for profilers.
            let name = recorder.path().extension().map_or_else(Default::default, |e| e.to_string_lossy().into_owned());
            let begin = move || write(recorder, &received, &slot);
            let thread = std::thread::Builder::new().name(name).spawn(begin).expect("the system starts a few threads");
            Worker { queue, thread, failed }
        };
        let batches = (0..BATCHES).map(|_| Arc::default()).collect();
        let folder = folder_of(recorders.first().map_or(Path::new(""), |recorder| recorder.path())).to_owned();
        let (scarce, now) = (is_scarce(&folder), Instant::now());
        let workers = recorders.into_iter().map(start).collect();
        Self { workers, batches, sent: now, folder, scarce, checked: now, closed: false }
    }

    /// Adds a sample.
    ///
    /// # Errors
    /// The first error of a recorder not returned yet; it may belong to an earlier sample.
    pub(crate) fn record(&mut self, sample: &Sample) -> Result<(), LogError> {
        let current = &mut self.batches[0];
        // No recorder uses this batch any more, since each queue is shorter than the ring. If one
        // still does, allocate a new batch.
        if Arc::get_mut(current).is_none() {
            *current = Arc::default();
        }
        if let Some(batch) = Arc::get_mut(current) {
            match batch.samples.get_mut(batch.used) {
                Some(free) => free.clone_from(sample),
                None => batch.samples.push(sample.clone()),
            }
            batch.used += 1;
            if batch.used == BATCH || self.sent.elapsed() >= PAUSE {
                self.send();
            }
        }
        self.unreported().map_or(Ok(()), Err)
    }

    /// Sends the batch to all recorders and begins the next.
    fn send(&mut self) {
        if self.batches[0].used == 0 {
            return;
        }
        for worker in &self.workers {
            // The error of a thread that has ended is returned by `join`.
            let _ = worker.queue.send(Message::Samples(self.batches[0].clone()));
        }
        self.sent = Instant::now();
        if self.sent - self.checked >= POLL_INTERVAL {
            (self.scarce, self.checked) = (is_scarce(&self.folder), self.sent);
        }
        if self.scarce {
            self.wait();
        }
        self.batches.rotate_left(1);
        if let Some(next) = Arc::get_mut(&mut self.batches[0]) {
            next.used = 0;
        }
    }

    /// Waits until all recorders have written all batches sent to them.
    fn wait(&self) {
        let (reached, all) = sync_channel(self.workers.len());
        for worker in &self.workers {
            let _ = worker.queue.send(Message::Reach(reached.clone()));
        }
        drop(reached);
        // Ends when all senders are dropped.
        all.iter().for_each(drop);
    }

    /// Sends the waiting samples and the result; does nothing when called again.
    pub(crate) fn close(&mut self, result: &RunResult) {
        if std::mem::replace(&mut self.closed, true) {
            return;
        }
        self.send();
        let result = Arc::new(result.clone());
        for worker in &self.workers {
            let _ = worker.queue.send(Message::Finish(result.clone()));
        }
    }

    /// Sends the result ([`Threads::close`]) and waits until everything is written; returns the
    /// recorders and the first error.
    ///
    /// # Panics
    /// If a recorder panicked.
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

    /// Returns the first error not returned yet.
    fn unreported(&self) -> Option<LogError> {
        self.workers.iter().find_map(|worker| worker.failed.lock().unwrap_or_else(PoisonError::into_inner).take())
    }
}

impl Drop for Threads {
    fn drop(&mut self) {
        if self.workers.is_empty() {
            return;
        }
        self.send();
        for Worker { queue, thread, .. } in self.workers.drain(..) {
            drop(queue);
            let _ = thread.join(); // the recorder is dropped with the thread and closes its file
        }
    }
}

/// Body of a thread: writes samples until the queue ends or a write fails, then the result.
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
