//! Sending on a serial line whose transmitter says when it has room.

/// How often the flag is looked at: a byte takes 10 µs, a look at least 20 ns.
const LOOKS: u32 = 10_000;

/// Sends all of a frame; false when the transmitter had no room in time.
pub(in crate::board) fn send(frame: &[u8], has_room: impl Fn() -> bool, put: impl Fn(u8)) -> bool {
    frame.iter().all(|&byte| {
        let room = (0..LOOKS).any(|_| has_room());
        if room {
            put(byte);
        }
        room
    })
}
