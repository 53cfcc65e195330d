//! Which channel a message is of: by the definitions of schemas and channels in the chunks, by those that the summary repeats, and by the
//! channels' names before all chunks where neither can be read.

use super::{Scanner, Trouble, refusal};
use crate::ReadError;
use crate::channel::Channel;
use crate::payload::{ENCODINGS, Encoding, Payload, PayloadError, Unknown};
use mcap::records::Channel as FileChannel;
use std::collections::BTreeMap;

impl<F: FnMut(Channel, Payload<'_>) -> Result<(), PayloadError>> Scanner<'_, F> {
    /// Takes schemas and channels from the summary; what it does not have, as they are named before all chunks.
    pub(super) fn take_definitions(&mut self) -> Result<(), Trouble> {
        for (opcode, content) in std::mem::take(&mut self.definitions) {
            match self.take_plain(opcode, &content) {
                // Then it is damaged itself.
                Err(Trouble::Broken(_)) | Ok(()) => {}
                refused => return refused,
            }
        }
        self.take_channel_names();
        Ok(())
    }

    /// Takes the channels that are not known yet, because the chunk with their definitions is damaged.
    fn take_channel_names(&mut self) {
        for (id, name) in std::mem::take(&mut self.channel_names) {
            let words: Vec<&str> = name.split(' ').collect();
            let (Ok(id), [topic, encoding, type_name]) = (id.parse(), words.as_slice()) else {
                continue;
            };
            let is_ours = Channel::ALL.iter().any(|known| known.topic() == *topic);
            if !is_ours || self.channels.contains_key(&id) {
                continue;
            }
            let channel = FileChannel {
                id,
                schema_id: 0,
                topic: (*topic).to_owned(),
                message_encoding: (*encoding).to_owned(),
                metadata: BTreeMap::new(),
            };
            // No checksum covers this record: it is no reason to refuse a log, and the definitions overrule it where they are whole.
            let _ = self.take_channel(channel, type_name);
        }
    }

    pub(super) fn take_channel(&mut self, channel: FileChannel, schema: &str) -> Result<(), ReadError> {
        let known = Channel::ALL
            .iter()
            .copied()
            .find(|known| known.topic() == channel.topic);
        let Some(known) = known else {
            if self.channels.insert(channel.id, None).is_none() {
                self.foreign.push(channel.topic);
            }
            return Ok(());
        };
        if known == Channel::Timing && schema != known.type_name() {
            // No analysis needs the timings, so those of an older version are skipped.
            if self.channels.insert(channel.id, None).is_none() {
                self.foreign
                    .push(format!("{} ('{schema}', of another version)", channel.topic));
            }
            return Ok(());
        }
        let problem = match Encoding::of(known, &channel.message_encoding, schema) {
            Ok(encoding) => {
                self.channels.insert(channel.id, Some((known, encoding)));
                return Ok(());
            }
            Err(Unknown::Encoding) => format!(
                "holds messages encoded as '{}', not as {ENCODINGS}",
                channel.message_encoding
            ),
            Err(Unknown::Type) => format!(
                "holds '{schema}', and this version of wormd reads '{}'",
                known.type_name()
            ),
        };
        let writer = self.contents.metadata.get("wormd_version");
        let remedy = match writer {
            Some(version) => format!("read it with wormd {version}, which wrote it"),
            None => "read it with what wrote it; `wormd record` writes logs that wormd reads".to_owned(),
        };
        Err(refusal(
            self.path,
            Some(format!("channel {}", channel.topic)),
            problem,
            &remedy,
        ))
    }
}
