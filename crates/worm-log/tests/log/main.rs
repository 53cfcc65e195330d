//! Logs of a worm's topics: what is written is read back, whatever happens to the file, and replays to the same results.

mod chunks;
mod damage;
mod export;
mod replay;
mod writing;

use worm_estimator::message::JsonMessage;

/// Messages as lines of JSON, to compare them to the last digit.
fn text<T: JsonMessage>(messages: &[T]) -> Vec<u8> {
    let mut text = Vec::new();
    for message in messages {
        message.write_json(&mut text).expect("can be written");
    }
    text
}
