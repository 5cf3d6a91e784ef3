//! Reader of the CDR that [`crate::mcap_file`] writes: little endian, values at multiples of their size.

/// A message being read; every step is `None` behind its end.
pub(super) struct CdrReader<'m> {
    body: &'m [u8],
    at: usize,
}

impl<'m> CdrReader<'m> {
    pub(super) fn new(message: &'m [u8]) -> Option<Self> {
        let body = message.strip_prefix(&[0x00, 0x01, 0x00, 0x00])?;
        Some(Self { body, at: 0 })
    }

    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let start = self.at.checked_next_multiple_of(N)?;
        let bytes = self.body.get(start..start.checked_add(N)?)?;
        self.at = start + N;
        bytes.try_into().ok()
    }

    pub(super) fn u8(&mut self) -> Option<u8> {
        self.take::<1>().map(|[byte]| byte)
    }

    pub(super) fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    pub(super) fn f64(&mut self) -> Option<f64> {
        self.take().map(f64::from_le_bytes)
    }

    pub(super) fn f64s<const N: usize>(&mut self) -> Option<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64()?;
        }
        Some(values)
    }

    /// `float64[]`.
    pub(super) fn f64_sequence(&mut self) -> Option<Vec<f64>> {
        let count = self.u32()? as usize;
        if count > self.body.len() / 8 {
            return None;
        }
        (0..count).map(|_| self.f64()).collect()
    }

    pub(super) fn string(&mut self) -> Option<&'m str> {
        let length = self.u32()? as usize;
        let bytes = self.body.get(self.at..self.at.checked_add(length)?)?;
        self.at += length;
        std::str::from_utf8(bytes.strip_suffix(&[0])?).ok()
    }

    /// `builtin_interfaces/Time` (ns).
    pub(super) fn time(&mut self) -> Option<u64> {
        let seconds = u64::from(self.u32()?);
        Some(seconds * 1_000_000_000 + u64::from(self.u32()?))
    }

    /// `std_msgs/Header`: its frame.
    pub(super) fn header(&mut self) -> Option<&'m str> {
        self.time()?;
        self.string()
    }

    /// `std_msgs/Float64MultiArray` of one dimension: label and numbers.
    pub(super) fn labelled_array(&mut self) -> Option<(&'m str, Vec<f64>)> {
        let mut label = "";
        for _ in 0..self.u32()?.min(8) {
            label = self.string()?;
            self.u32()?;
            self.u32()?;
        }
        self.u32()?;
        Some((label, self.f64_sequence()?))
    }
}
