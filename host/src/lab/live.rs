//! The live view on the page: a device's line read in a thread, and what is new told as server-sent
//! events.

use super::locked;
use crate::device::live::{Column, Happened, LiveView, LoopPoint, Picture};
use crate::device::telemetry::line::Source;
use crate::device::telemetry::steady::{SteadyLine, Wanted};
use crate::text::error::{Error, Result};
use axum::body::Bytes;
use hyper::body::{Body, Frame};
use jointwatch_shared::wire::telemetry::BAUD;
use serde::{Deserialize, Serialize};
use std::convert::Infallible;
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::task::{Context, Poll};
use std::time::{Duration, Instant};
use tokio::sync::{mpsc, watch};

/// From one event to the next while a device is heard.
const EVERY: Duration = Duration::from_millis(100);
/// The same while none is.
const IDLE: Duration = Duration::from_secs(20);
/// How long the line is waited for at a time.
const WAIT: Duration = Duration::from_millis(50);

/// Where the page wants to listen.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum Place {
    /// Host and port of a program that hands on what a device sends.
    Tcp(String),
    /// The name of a serial port.
    Port(String),
}

/// The device that the pages look at, if any.
pub(super) struct Live {
    watching: Mutex<Option<Arc<Watching>>>,
    /// Counts how often another device is looked at.
    turns: watch::Sender<u64>,
}

/// The view of one device, which a thread of its own keeps up to date.
struct Watching {
    view: Mutex<LiveView>,
    begun: Instant,
    stop: AtomicBool,
}

impl Drop for Live {
    fn drop(&mut self) {
        self.leave();
    }
}

impl Live {
    pub(super) fn new() -> Self {
        Self {
            watching: Mutex::new(None),
            turns: watch::Sender::new(1),
        }
    }

    fn now(&self) -> MutexGuard<'_, Option<Arc<Watching>>> {
        locked(&self.watching)
    }

    /// Opens a line, which may take seconds, and looks at its device from then on.
    ///
    /// # Errors
    /// As [`SteadyLine::open`].
    pub(super) fn connect(&self, place: Place) -> Result<()> {
        let source = match place {
            Place::Tcp(address) => Source::Tcp(address),
            Place::Port(name) => Source::Port(name, BAUD),
        };
        // A port belongs to one program: the old line is let go before.
        self.leave();
        let line = SteadyLine::open(source, Wanted::Shown)?;
        let watching = Arc::new(Watching {
            view: Mutex::new(LiveView::new(&line.source().name())),
            begun: Instant::now(),
            stop: AtomicBool::new(false),
        });
        let reading = Arc::clone(&watching);
        std::thread::Builder::new()
            .spawn(move || reading.read(line))
            .map_err(|e| Error::failed(format!("the line could not be read ({e})")))?;
        if let Some(before) = self.now().replace(watching) {
            before.stop.store(true, Ordering::Relaxed);
        }
        self.turns.send_modify(|turn| *turn += 1);
        Ok(())
    }

    /// Looks at no device any more.
    pub(super) fn leave(&self) {
        if let Some(before) = self.now().take() {
            before.stop.store(true, Ordering::Relaxed);
            self.turns.send_modify(|turn| *turn += 1);
        }
    }

    /// What a page is told from now on: all there is, then what is new. Costs nothing while no
    /// device is looked at.
    pub(super) fn events(self: &Arc<Self>) -> Events {
        let (send, told) = mpsc::channel(2);
        let live = Arc::clone(self);
        tokio::spawn(async move {
            let mut turns = live.turns.subscribe();
            let mut seen = Seen::default();
            loop {
                let turn = *turns.borrow_and_update();
                if turn != seen.turn {
                    seen = Seen {
                        turn,
                        ..Seen::default()
                    };
                }
                let watching = live.now().clone();
                let is_watching = watching.is_some();
                let news = News::since(&mut seen, watching.as_deref());
                let Ok(json) = serde_json::to_string(&news) else {
                    return;
                };
                // A page that is gone is told nothing more.
                if send.send(format!("data: {json}\n\n").into()).await.is_err() {
                    return;
                }
                if is_watching {
                    tokio::time::sleep(EVERY).await;
                } else {
                    // Told again now and then, so that it is noticed when the page is gone.
                    let _ = tokio::time::timeout(IDLE, turns.changed()).await;
                }
            }
        });
        Events { told }
    }
}

impl Watching {
    fn view(&self) -> MutexGuard<'_, LiveView> {
        locked(&self.view)
    }

    fn read(&self, mut line: SteadyLine) {
        while !self.stop.load(Ordering::Relaxed) {
            let Ok(caught) = line.next(WAIT) else { break };
            let now = self.begun.elapsed();
            let mut view = self.view();
            caught.news.iter().for_each(|news| view.learn(news, now));
            view.hear(&caught.heard, line.tally(), now);
        }
        line.close();
    }
}

/// What a page has been told already.
#[derive(Default)]
struct Seen {
    turn: u64,
    generation: u64,
    columns: [u64; 2],
    points: [u64; 2],
    happened: u64,
}

/// What is new for one page: a server-sent event.
#[derive(Serialize)]
struct News {
    /// Another number: what was drawn is of another device, or of before its restart.
    plots: [u64; 2],
    picture: Option<Picture>,
    axes: Vec<AxisNews>,
    happened: Vec<Happened>,
}

#[derive(Serialize)]
struct AxisNews {
    /// New ones; the first may be the last of before, grown.
    columns: Vec<Column>,
    points: Vec<LoopPoint>,
}

impl News {
    fn since(seen: &mut Seen, watching: Option<&Watching>) -> Self {
        let Some(watching) = watching else {
            return Self {
                plots: [seen.turn, 0],
                picture: None,
                axes: Vec::new(),
                happened: Vec::new(),
            };
        };
        let view = watching.view();
        if view.generation() != seen.generation {
            (seen.columns, seen.points) = ([0; 2], [0; 2]);
            seen.generation = view.generation();
        }
        let axes = view.traces().iter().enumerate().map(|(axis, trace)| {
            let columns = trace.columns().filter(|c| c.at >= seen.columns[axis]);
            let points = trace.points().filter(|p| p.number >= seen.points[axis]);
            let news = AxisNews {
                columns: columns.copied().collect(),
                points: points.copied().collect(),
            };
            if let Some(last) = news.columns.last() {
                seen.columns[axis] = last.at;
            }
            if let Some(last) = news.points.last() {
                seen.points[axis] = last.number + 1;
            }
            news
        });
        let axes = axes.collect();
        let happened = view.happened().filter(|h| h.number > seen.happened);
        let happened: Vec<Happened> = happened.cloned().collect();
        seen.happened = happened.last().map_or(seen.happened, |last| last.number);
        Self {
            plots: [seen.turn, seen.generation],
            picture: Some(view.picture(watching.begun.elapsed())),
            axes,
            happened,
        }
    }
}

/// The body of an answer that goes on.
pub(super) struct Events {
    told: mpsc::Receiver<Bytes>,
}

impl Body for Events {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<std::result::Result<Frame<Bytes>, Infallible>>> {
        let told = self.told.poll_recv(context);
        told.map(|bytes| bytes.map(|bytes| Ok(Frame::data(bytes))))
    }
}
