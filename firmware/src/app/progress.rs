//! When the watchdog is fed: only when sampling, evaluation and what follows it all go on, the
//! serial line's end among it.

use core::sync::atomic::{AtomicBool, Ordering};

/// Which sample was seen last at the end of the evaluation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    next: u64,
}

impl Progress {
    /// Whether the watchdog is to be fed after a turn of the evaluation that handed on samples up
    /// to this number, if any.
    ///
    /// A sample that was not there before shows that sampling goes on; that it was handed on, that
    /// it was evaluated, and that the monitor takes what it is given: its queue holds three,
    /// and a full one takes nothing. `served` is set by every turn of what serves the line;
    /// between two feedings there has to be one.
    pub fn made(&mut self, handed_on: Option<u64>, served: &AtomicBool) -> bool {
        match handed_on {
            Some(number) if number >= self.next => {
                self.next = number.saturating_add(1);
                let served_since = served.load(Ordering::Relaxed);
                // A turn between these two lines is missed; the next one counts.
                served.store(false, Ordering::Relaxed);
                served_since
            }
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Evaluated, Frame, Lost, evaluate};
    use super::*;
    use heapless::spsc::Queue;
    use jointwatch_shared::base::kernels::Portable;

    #[test]
    fn it_is_fed_while_samples_come_and_the_monitor_takes_them() {
        let mut frames: Queue<Frame, 4> = Queue::new();
        let mut evaluated: Queue<Evaluated, 4> = Queue::new();
        let (mut frames_in, mut frames) = frames.split();
        let (mut evaluated_in, mut evaluated) = evaluated.split();
        let (mut progress, mut lost, mut number) = (Progress::default(), Lost::default(), 0);
        let mut turn = |samples: u32, monitor_takes: bool| {
            for _ in 0..samples {
                let frame = Frame {
                    number,
                    ..Frame::default()
                };
                frames_in.enqueue(frame).unwrap();
                number += 1;
            }
            let newest = evaluate::<Portable>(None, &mut frames, &mut evaluated_in, &mut lost);
            while monitor_takes && evaluated.dequeue().is_some() {}
            progress.made(newest, &AtomicBool::new(true))
        };
        assert!(turn(1, true));
        assert!(turn(1, true));
        // The evaluation runs and nothing was sampled.
        assert!(!turn(0, true));
        // Late, but all goes on.
        assert!(turn(3, true));
        // The monitor stands still: its queue takes three more, and then no more feeding.
        let fed = [(); 5].map(|()| turn(1, false));
        assert_eq!(fed, [true, true, true, false, false]);
        // It goes on, with the next sample.
        assert!(!turn(0, true));
        assert!(turn(1, true));
    }

    #[test]
    fn a_sample_feeds_once() {
        let mut progress = Progress::default();
        let served = AtomicBool::new(true);
        let fed = [Some(7), Some(7), Some(6), None, Some(8)].map(|n| {
            served.store(true, Ordering::Relaxed);
            progress.made(n, &served)
        });
        assert_eq!(fed, [true, false, false, false, true]);
        // Samples go on and nobody serves the line.
        served.store(true, Ordering::Relaxed);
        let fed = [Some(9), Some(10), Some(11)].map(|n| progress.made(n, &served));
        assert_eq!(fed, [true, false, false]);
    }
}
