//! Serialiser for the plain CDR of ROS 2 messages (XCDR version 1, little endian).
//!
//! A value of n bytes starts at a multiple of n, counted from the end of the four-byte encapsulation header;
//! strings carry their length with a closing zero, sequences their count. [OMG DDSI-RTPS 2.5, section 10].

/// Encapsulation header: CDR, little endian, no options.
const ENCAPSULATION: [u8; 4] = [0x00, 0x01, 0x00, 0x00];

/// One message in the making. The buffer is used again for the next one.
#[derive(Debug, Default)]
pub(crate) struct Cdr {
    bytes: Vec<u8>,
}

impl Cdr {
    /// Forgets the last message and starts another.
    pub(crate) fn start(&mut self) -> &mut Self {
        self.bytes.clear();
        self.bytes.extend(ENCAPSULATION);
        self
    }

    /// Gives memory beyond so many bytes back.
    pub(crate) fn shrink_to(&mut self, kept: usize) {
        self.bytes.clear();
        self.bytes.shrink_to(kept);
    }

    /// The message so far.
    pub(crate) fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// A part that was made before at the same place of another message.
    pub(crate) fn made(&mut self, bytes: &[u8]) -> &mut Self {
        self.bytes.extend_from_slice(bytes);
        self
    }

    /// `bool`, `byte` and `uint8`.
    pub(crate) fn u8(&mut self, value: u8) -> &mut Self {
        self.bytes.push(value);
        self
    }

    pub(crate) fn i32(&mut self, value: i32) -> &mut Self {
        self.aligned(value.to_le_bytes())
    }

    pub(crate) fn u32(&mut self, value: u32) -> &mut Self {
        self.aligned(value.to_le_bytes())
    }

    pub(crate) fn f32(&mut self, value: f32) -> &mut Self {
        self.aligned(value.to_le_bytes())
    }

    pub(crate) fn f64(&mut self, value: f64) -> &mut Self {
        self.aligned(value.to_le_bytes())
    }

    pub(crate) fn string(&mut self, text: &str) -> &mut Self {
        self.length(text.len() + 1);
        self.bytes.extend_from_slice(text.as_bytes());
        self.bytes.push(0);
        self
    }

    /// Count of a sequence; its elements follow.
    pub(crate) fn length(&mut self, count: usize) -> &mut Self {
        self.u32(u32::try_from(count).expect("a list or text of a recording has fewer than 2^32 entries"))
    }

    /// Values without a count: a fixed-size part of a message.
    pub(crate) fn f64s(&mut self, values: &[f64]) -> &mut Self {
        if values.is_empty() {
            return self;
        }
        self.align::<8>();
        let first = self.bytes.len();
        self.bytes.resize(first + size_of_val(values), 0);
        for (place, value) in self.bytes[first..].chunks_exact_mut(size_of::<f64>()).zip(values) {
            place.copy_from_slice(&value.to_le_bytes());
        }
        self
    }

    /// `float64[]`.
    pub(crate) fn f64_sequence(&mut self, values: &[f64]) -> &mut Self {
        self.length(values.len()).f64s(values)
    }

    /// `string[]`.
    pub(crate) fn string_sequence(&mut self, texts: &[String]) -> &mut Self {
        self.length(texts.len());
        for text in texts {
            self.string(text);
        }
        self
    }

    fn aligned<const N: usize>(&mut self, value: [u8; N]) -> &mut Self {
        self.align::<N>();
        self.bytes.extend_from_slice(&value);
        self
    }

    /// Goes on at a multiple of `N`, which is a power of two of at most 8.
    fn align<const N: usize>(&mut self) {
        let used = self.bytes.len() - ENCAPSULATION.len();
        let gap = used.wrapping_neg() % N;
        self.bytes.extend_from_slice(&[0; 8][..gap]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: worked out by hand from the alignment rule.
    #[test]
    fn values_start_at_multiples_of_their_size() {
        let mut cdr = Cdr::default();
        cdr.start().u32(7).string("ab").f64_sequence(&[1.0]);
        let expected: Vec<u8> = [
            vec![0, 1, 0, 0],                   // encapsulation, not counted
            vec![7, 0, 0, 0],                   // at 0
            vec![3, 0, 0, 0, b'a', b'b', 0],    // at 4: length with the zero
            vec![0],                            // padding to 12
            vec![1, 0, 0, 0],                   // at 12: count
            vec![0, 0, 0, 0, 0, 0, 0xf0, 0x3f], // at 16: 1.0
        ]
        .concat();
        assert_eq!(cdr.bytes(), expected);

        // An empty sequence ends after its count: no padding for elements that are not there.
        assert_eq!(cdr.start().f64_sequence(&[]).bytes(), [0, 1, 0, 0, 0, 0, 0, 0]);
    }
}
