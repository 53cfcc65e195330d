//! Messages in numbered pieces, so that a long history does not block what comes after it, and so that a laptop confirms what it has.

/// Longest content of a piece, bytes.
pub(crate) const MAX_CONTENT: usize = 16 << 10;
/// Stream, number, pieces of the message after this one.
const HEAD: usize = 8 + 8 + 4;
/// Largest message, bytes: the history of a worm with 16 cells takes 2 MB before it is compressed.
const MAX_MESSAGE: usize = 8 << 20;
/// Largest message once it is unpacked, bytes.
const MAX_UNPACKED: usize = 32 << 20;
/// Fast, and a third of the size.
const COMPRESSION: i32 = 1;

/// A message, packed and cut.
///
/// # Errors
/// When it cannot be packed.
pub(crate) fn cut(message: &[u8]) -> std::io::Result<Vec<Vec<u8>>> {
    let packed = zstd::bulk::compress(message, COMPRESSION)?;
    Ok(packed.chunks(MAX_CONTENT).map(<[u8]>::to_vec).collect())
}

/// A piece as it is sent. `rest` is how many of its message come after it.
pub(crate) fn to_bytes(stream: u64, sequence: u64, rest: u32, content: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEAD + content.len());
    bytes.extend(stream.to_le_bytes());
    bytes.extend(sequence.to_le_bytes());
    bytes.extend(rest.to_le_bytes());
    bytes.extend(content);
    bytes
}

/// Puts the pieces of one sender together again.
#[derive(Debug, Default)]
pub(crate) struct Assembler {
    /// The stream that is read, and the number of its newest piece.
    newest: Option<(u64, u64)>,
    /// The stream before it.
    former: Option<u64>,
    content: Vec<u8>,
    /// A piece is missing: nothing more is of use until another stream begins.
    is_lost: bool,
}

/// What a piece brought.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Assembled {
    /// A whole message.
    Message(Vec<u8>),
    /// A part of one.
    Part,
    /// A piece that is of no use: of an old stream, or after a gap.
    Useless,
}

impl Assembler {
    /// Takes a piece as it came.
    ///
    /// # Errors
    /// In words, for bytes that are no piece or no message; then a new stream is needed.
    pub(crate) fn take(&mut self, bytes: &[u8]) -> Result<Assembled, String> {
        let outcome = self.add(bytes);
        self.is_lost |= outcome.is_err();
        outcome
    }

    fn add(&mut self, bytes: &[u8]) -> Result<Assembled, String> {
        let too_short = || "the bridge sent what is no piece of a message".to_owned();
        let (stream, bytes) = bytes.split_first_chunk().ok_or_else(too_short)?;
        let (sequence, bytes) = bytes.split_first_chunk().ok_or_else(too_short)?;
        let (rest, content) = bytes.split_first_chunk().ok_or_else(too_short)?;
        let (stream, sequence) = (u64::from_le_bytes(*stream), u64::from_le_bytes(*sequence));
        let rest = u32::from_le_bytes(*rest);
        match self.newest {
            Some((current, newest)) if current == stream => {
                if self.is_lost || sequence != newest + 1 {
                    self.is_lost = true;
                    return Ok(Assembled::Useless);
                }
            }
            // It is late.
            _ if self.former == Some(stream) => return Ok(Assembled::Useless),
            current => {
                self.former = current.map(|(stream, _)| stream);
                self.content.clear();
                self.is_lost = sequence != 0;
                if self.is_lost {
                    self.newest = Some((stream, sequence));
                    return Ok(Assembled::Useless);
                }
            }
        }
        self.newest = Some((stream, sequence));
        if self.content.len() + content.len() > MAX_MESSAGE {
            return Err(format!("the bridge sent a message of more than {MAX_MESSAGE} bytes"));
        }
        self.content.extend_from_slice(content);
        if rest > 0 {
            return Ok(Assembled::Part);
        }
        let packed = std::mem::take(&mut self.content);
        zstd::bulk::decompress(&packed, MAX_UNPACKED)
            .map(Assembled::Message)
            .map_err(|error| format!("the bridge sent what cannot be unpacked ({error})"))
    }

    /// Stream and number of the newest piece.
    pub(crate) fn newest(&self) -> Option<(u64, u64)> {
        self.newest
    }

    /// Whether another stream is needed.
    pub(crate) fn is_lost(&self) -> bool {
        self.is_lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    fn pieces(stream: u64, messages: &[Vec<u8>]) -> Vec<Vec<u8>> {
        let mut all = Vec::new();
        for message in messages {
            let cut = cut(message).expect("can be packed");
            let count = cut.len() as u32;
            for (index, content) in cut.iter().enumerate() {
                let sequence = all.len() as u64;
                all.push(to_bytes(stream, sequence, count - 1 - index as u32, content));
            }
        }
        all
    }

    #[test]
    fn messages_come_out_as_they_went_in_and_none_after_a_gap() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        let messages: Vec<Vec<u8>> = [0, 1, 100, MAX_CONTENT, 5 * MAX_CONTENT]
            .iter()
            .map(|&length| (0..length).map(|_| rng.random()).collect())
            .collect();
        let mut assembler = Assembler::default();
        let mut whole = Vec::new();
        for piece in pieces(7, &messages) {
            if let Assembled::Message(message) = assembler.take(&piece).expect("is a piece") {
                whole.push(message);
            }
        }
        assert_eq!(whole, messages);

        let mut all = pieces(8, &messages);
        all.remove(2);
        let found: Vec<_> = all
            .iter()
            .map(|piece| assembler.take(piece).expect("is a piece"))
            .collect();
        assert!(found[2..].iter().all(|it| *it == Assembled::Useless), "after the gap");
        assert!(assembler.is_lost());
        // Of the stream before.
        assert_eq!(assembler.take(&pieces(7, &messages)[0]), Ok(Assembled::Useless));
        assert_eq!(
            assembler.take(&pieces(9, &messages)[0]),
            Ok(Assembled::Message(messages[0].clone()))
        );
        assert!(!assembler.is_lost());
    }

    #[test]
    fn damaged_pieces_are_refused_in_words() {
        let good = pieces(1, &[b"a message".to_vec()]).remove(0);
        for length in 0..HEAD {
            let refusal = Assembler::default().take(&good[..length]).expect_err("too short");
            assert!(refusal.contains("no piece"), "{refusal}");
        }
        let mut damaged = good.clone();
        damaged[HEAD] ^= 0xff;
        let mut assembler = Assembler::default();
        let refusal = assembler.take(&damaged).expect_err("is damaged");
        assert!(refusal.contains("cannot be unpacked"), "{refusal}");
        assert!(assembler.is_lost());
    }
}
