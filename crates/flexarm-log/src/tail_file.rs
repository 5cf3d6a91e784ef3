//! A file with a provisional end: what makes a recording safe against a kill without making it depend on time.
//!
//! Formats with chunks want large ones, closed at points that only the data decide; whoever watches a run, or
//! kills it, wants the last second in the file now. [`TailFile`] serves both: committed bytes are final, and
//! [`TailFile::set_tail`] puts a provisional end behind them, which the next committed bytes overwrite. The
//! finished file is the committed bytes alone.
//!
//! A write that fails (full disk) takes nothing away: the file is put back to what it was, old tail included, and can be
//! read up to there.

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};

use crate::written_behind::WrittenBehind;

/// Committed bytes beyond which a recorder should write them out even before its time: what is held in memory, and what is
/// lost where the file may not grow further. A quarter of what is in the file, within these.
const PENDING_LIMIT: usize = 3 << 20;
const LEAST_PENDING: usize = 256 << 10;

/// Bytes that are handed to the system at once: it copies large pieces more slowly. 2 GB in pieces of 128 or 256 kB took it
/// about half of the time of pieces of 1 MB and more (`dd`).
const PIECE: usize = 256 << 10;

/// See the module.
#[derive(Debug)]
pub(crate) struct TailFile {
    file: File,
    /// Committed bytes not yet in the file.
    pending: Vec<u8>,
    /// Committed bytes in the file.
    written: u64,
    /// Provisional bytes in the file, behind the committed ones.
    tail: Vec<u8>,
    behind: WrittenBehind,
}

impl TailFile {
    /// Around a new, empty file.
    pub(crate) fn new(file: File) -> Self {
        Self { file, pending: Vec::new(), written: 0, tail: Vec::new(), behind: WrittenBehind::default() }
    }

    /// Number of committed bytes.
    pub(crate) fn position(&self) -> u64 {
        self.written + self.pending.len() as u64
    }

    /// Whether so much is held back that a new tail should be set even before its time.
    pub(crate) fn is_full(&self) -> bool {
        self.pending.len() > ((self.written / 4) as usize).clamp(LEAST_PENDING, PENDING_LIMIT)
    }

    /// Writes out what is committed, then `tail` behind it, in place of any earlier tail.
    ///
    /// # Errors
    /// Those of the operating system; the file then is what it was before, as far as that can be had.
    pub(crate) fn set_tail(&mut self, mut tail: Vec<u8>) -> io::Result<()> {
        let old_end = self.written + self.tail.len() as u64;
        if let Err(error) = self.replace_tail(&tail, old_end) {
            // In place, where the space is taken already. Should even that fail, the first error is the one to tell.
            let _ = self.file.seek(SeekFrom::Start(self.written)).and_then(|_| self.file.write_all(&self.tail));
            let _ = self.file.set_len(old_end);
            return Err(error);
        }
        self.written += self.pending.len() as u64;
        self.pending.clear();
        // What the beginning took, surfaces and files, is not needed again.
        self.pending.shrink_to(PENDING_LIMIT + PENDING_LIMIT / 4);
        tail.shrink_to_fit();
        self.tail = tail;
        self.behind.advance(&self.file, self.written);
        Ok(())
    }

    fn replace_tail(&mut self, tail: &[u8], old_end: u64) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(self.written))?;
        let mut pieces = self.pending.chunks(PIECE).chain(tail.chunks(PIECE));
        pieces.try_for_each(|piece| self.file.write_all(piece))?;
        // Rest of an earlier, longer tail. Cut last: a reader in between meets rubbish behind good data, no gap.
        let end = self.written + (self.pending.len() + tail.len()) as u64;
        if end < old_end {
            self.file.set_len(end)?;
        }
        Ok(())
    }
}

impl Write for TailFile {
    /// Only holds the bytes back: a file whose tail were overwritten by them would have no end until the next one.
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.pending.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    /// Writes out what is committed and removes the tail.
    fn flush(&mut self) -> io::Result<()> {
        self.set_tail(Vec::new())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the finished file is the committed bytes, whatever tails were there in between.
    #[test]
    fn a_tail_is_seen_until_the_next_bytes_and_leaves_no_trace() {
        let path = std::env::temp_dir().join(format!("flexarm-tail-{}", std::process::id()));
        let mut file = TailFile::new(File::create(&path).unwrap());
        let read = || std::fs::read_to_string(&path).unwrap();

        file.write_all(b"one ").unwrap();
        assert_eq!((read().as_str(), file.position()), ("", 4));
        file.set_tail(b"provisional".to_vec()).unwrap();
        assert_eq!((read().as_str(), file.position()), ("one provisional", 4));
        file.set_tail(b"longer provisional".to_vec()).unwrap();
        assert_eq!(read(), "one longer provisional");
        file.write_all(b"two ").unwrap();
        file.set_tail(b"end".to_vec()).unwrap();
        assert_eq!((read().as_str(), file.position()), ("one two end", 8));
        file.flush().unwrap();
        assert_eq!(read(), "one two ");
        std::fs::remove_file(&path).unwrap();
    }

    /// Truth: a file opened for reading refuses every write; its content is that of before, tail included.
    #[test]
    fn a_write_that_fails_leaves_the_file_as_it_was() {
        let path = std::env::temp_dir().join(format!("flexarm-tail-fails-{}", std::process::id()));
        let mut file = TailFile::new(File::create(&path).unwrap());
        file.write_all(b"one ").unwrap();
        file.set_tail(b"end".to_vec()).unwrap();
        file.file = File::open(&path).unwrap();
        file.write_all(b"two ").unwrap();
        assert!(file.set_tail(b"another end".to_vec()).is_err());
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "one end");
        // Once there is room again, nothing has been lost.
        file.file = std::fs::OpenOptions::new().write(true).open(&path).unwrap();
        file.set_tail(b"last end".to_vec()).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "one two last end");
        std::fs::remove_file(&path).unwrap();
    }
}
