//! Records of an MCAP file as bytes: an opcode, the length of the body, the body. [MCAP specification]

pub(super) const HEADER: u8 = 0x01;
pub(super) const FOOTER: u8 = 0x02;
pub(super) const SCHEMA: u8 = 0x03;
pub(super) const CHANNEL: u8 = 0x04;
pub(super) const MESSAGE: u8 = 0x05;
pub(super) const CHUNK: u8 = 0x06;
pub(super) const MESSAGE_INDEX: u8 = 0x07;
pub(super) const CHUNK_INDEX: u8 = 0x08;
pub(super) const ATTACHMENT: u8 = 0x09;
pub(super) const ATTACHMENT_INDEX: u8 = 0x0a;
pub(super) const STATISTICS: u8 = 0x0b;
pub(super) const METADATA: u8 = 0x0c;
pub(super) const METADATA_INDEX: u8 = 0x0d;
pub(super) const SUMMARY_OFFSET: u8 = 0x0e;
pub(super) const DATA_END: u8 = 0x0f;

/// Bytes of a record before its body.
pub(super) const HEAD: usize = 1 + 8;

/// Adds opcode and length of a record whose body follows.
pub(super) fn push_head(to: &mut Vec<u8>, opcode: u8, length: u64) {
    to.push(opcode);
    to.extend_from_slice(&length.to_le_bytes());
}

/// Body of a record in the making.
#[derive(Clone, Debug, Default)]
pub(super) struct Body(Vec<u8>);

impl Body {
    pub(super) fn u8(&mut self, value: u8) -> &mut Self {
        self.0.push(value);
        self
    }

    pub(super) fn u16(&mut self, value: u16) -> &mut Self {
        self.0.extend_from_slice(&value.to_le_bytes());
        self
    }

    pub(super) fn u32(&mut self, value: u32) -> &mut Self {
        self.0.extend_from_slice(&value.to_le_bytes());
        self
    }

    pub(super) fn u64(&mut self, value: u64) -> &mut Self {
        self.0.extend_from_slice(&value.to_le_bytes());
        self
    }

    /// Bytes with their number before them.
    pub(super) fn block(&mut self, bytes: &[u8]) -> &mut Self {
        self.u32(u32::try_from(bytes.len()).expect("part of an index below 4 GiB"));
        self.0.extend_from_slice(bytes);
        self
    }

    pub(super) fn string(&mut self, text: &str) -> &mut Self {
        self.block(text.as_bytes())
    }

    /// Texts by name, with their length in bytes before them.
    pub(super) fn pairs<'a>(&mut self, pairs: impl IntoIterator<Item = (&'a String, &'a String)>) -> &mut Self {
        let mut list = Self::default();
        for (name, value) in pairs {
            list.string(name).string(value);
        }
        self.block(&list.0)
    }

    pub(super) fn bytes(&self) -> &[u8] {
        &self.0
    }

    /// Adds the record to `to`.
    pub(super) fn push(&self, to: &mut Vec<u8>, opcode: u8) {
        push_head(to, opcode, self.0.len() as u64);
        to.extend_from_slice(&self.0);
    }
}

/// Opcode and body of the record at a place, if it is there as a whole.
pub(super) fn record(bytes: &[u8], at: usize) -> Option<(u8, &[u8])> {
    let (head, rest) = bytes.get(at..)?.split_at_checked(HEAD)?;
    let length = u64::from_le_bytes(head[1..].try_into().ok()?) as usize;
    Some((head[0], rest.get(..length)?))
}
