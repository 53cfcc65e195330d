//! Messages into the channels that Foxglove's clients subscribe to.

use crate::failure::Failure;
use crate::realtime::monotonic_ns;
use crate::recorder::Batch;
use foxglove::{ChannelBuilder, Context, PartialMetadata, RawChannel, Schema};
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};
use worm_log::{Channel, Logged};

/// Encoding of messages and of their schemas, as Foxglove names it.
const PROTOBUF: &str = "protobuf";

/// One channel for each topic, named and encoded as in a log.
pub(super) struct Channels {
    /// The channels are closed when it goes.
    _context: Arc<Context>,
    open: Vec<(Channel, Arc<RawChannel>)>,
    /// The message that is being written.
    bytes: Vec<u8>,
}

impl Channels {
    /// Makes a channel for each of `topics`.
    ///
    /// # Errors
    /// [`Failure::Failed`] when Foxglove refuses one.
    pub(super) fn open(context: &Arc<Context>, topics: &[Channel]) -> Result<Self, Failure> {
        let open = topics.iter().map(|&channel| {
            let schema = Schema::new(channel.type_name(), PROTOBUF, channel.descriptor_set());
            let raw = ChannelBuilder::new(channel.topic())
                .context(context)
                .message_encoding(PROTOBUF)
                .schema(schema)
                .build_raw()
                .map_err(Failure::failed)?;
            Ok((channel, raw))
        });
        Ok(Self {
            _context: Arc::clone(context),
            open: open.collect::<Result<_, Failure>>()?,
            bytes: Vec::new(),
        })
    }

    /// Passes a batch on to who has subscribed to it.
    pub(super) fn send(&mut self, batch: &Batch) {
        let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        // What has to be added to a monotonic time. Computed anew for each batch: the wall clock may be set while the worm runs.
        let offset_ns = u64::try_from(since_epoch.as_nanos())
            .unwrap_or(u64::MAX)
            .saturating_sub(monotonic_ns());
        self.send_all(&batch.states, offset_ns);
        self.send_all(&batch.timings, offset_ns);
        self.send_all(&batch.estimates, offset_ns);
        self.send_all(&batch.cycles, offset_ns);
        self.send_all(&batch.alarms, offset_ns);
        self.send_all(&batch.ranges, offset_ns);
        self.send_all(&batch.commands, offset_ns);
        self.send_all(&batch.trips, offset_ns);
        self.send_all(&batch.inferred, offset_ns);
    }

    fn send_all<T: Logged>(&mut self, messages: &[T], offset_ns: u64) {
        let Some((_, channel)) = self.open.iter().find(|(channel, _)| *channel == T::CHANNEL) else {
            return;
        };
        if !channel.has_sinks() {
            return;
        }
        for message in messages {
            self.bytes.clear();
            message.write_protobuf(&mut self.bytes);
            // An estimate before the first state has no time of its own.
            let made_ns = match message.made_ns() {
                0 => monotonic_ns(),
                made_ns => made_ns,
            };
            let metadata = PartialMetadata::with_log_time(made_ns.saturating_add(offset_ns));
            channel.log_with_meta(&self.bytes, metadata);
        }
    }
}
