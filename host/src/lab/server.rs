//! The server: on the loopback address, few connections, none of them slow.

use super::folder::Folder;
use super::guard::Guard;
use super::routes::routes;
use super::session::Session;
use crate::text::error::{Error, Result};
use base64::Engine;
use base64::engine::general_purpose::URL_SAFE_NO_PAD;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use rand::Rng;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::TcpListener;
use tokio::sync::Semaphore;

/// As many connections are served at a time.
const CONNECTIONS: usize = 64;
/// A request's head has to be there in this time.
const SLOWEST_HEAD: Duration = Duration::from_secs(5);
/// No connection lasts longer than this; pages open another one.
const LONGEST: Duration = Duration::from_secs(600);

/// What a lab is opened with.
pub struct Lab {
    /// A study.toml, its folder, or logs; the working folder when empty.
    pub named: Vec<PathBuf>,
    /// The model to show first.
    pub model: Option<PathBuf>,
    /// The port; any free one when left out.
    pub port: Option<u16>,
    /// The program whose commands do the work: this one.
    pub program: PathBuf,
}

/// A lab that listens.
pub struct Started {
    /// Where it listens, with the token.
    pub url: String,
    /// The study's folder as an absolute path.
    pub folder: PathBuf,
    runtime: tokio::runtime::Runtime,
    listener: TcpListener,
    routes: axum::Router,
}

impl Lab {
    /// Opens the study and begins to listen.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Failed`] when something named is not there or the port is taken;
    /// [`crate::text::error::Kind::Usage`] when what is named does not go together.
    pub fn start(self) -> Result<Started> {
        let folder = Folder::of(&self.named)?;
        let path = folder.path.clone();
        let model = self.model.map(|m| in_folder(&path, m)).transpose()?;
        let failed = |e: std::io::Error| {
            let port = self
                .port
                .map_or("a free port".into(), |p| format!("port {p}"));
            Error::failed(format!(
                "127.0.0.1, {port}: cannot be listened on ({e}); give another one with --port"
            ))
        };
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_io()
            .enable_time()
            .build()
            .map_err(failed)?;
        let address = SocketAddr::from((Ipv4Addr::LOCALHOST, self.port.unwrap_or(0)));
        let listener = runtime
            .block_on(TcpListener::bind(address))
            .map_err(failed)?;
        let port = listener.local_addr().map_err(failed)?.port();
        let mut random = [0_u8; 24];
        rand::rng().fill_bytes(&mut random);
        let token = URL_SAFE_NO_PAD.encode(random);
        let session = Session::new(folder, model, self.program);
        session.open();
        Ok(Started {
            url: format!("http://127.0.0.1:{port}/#{token}"),
            folder: path,
            routes: routes(session, Guard { port, token }),
            runtime,
            listener,
        })
    }
}

impl Started {
    /// Serves until the process ends.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Failed`] when no more connections can be taken.
    pub fn serve(self) -> Result<()> {
        let Self {
            runtime,
            listener,
            routes,
            ..
        } = self;
        runtime.block_on(async {
            let places = Arc::new(Semaphore::new(CONNECTIONS));
            loop {
                let Ok(place) = Arc::clone(&places).acquire_owned().await else {
                    return Err(Error::failed("the lab's server stopped; start it again"));
                };
                // A connection that broke before it was taken is nobody's loss.
                let Ok((stream, _)) = listener.accept().await else {
                    tokio::time::sleep(Duration::from_millis(20)).await;
                    continue;
                };
                let service = TowerToHyperService::new(routes.clone());
                tokio::spawn(async move {
                    let connection = http1::Builder::new()
                        .timer(TokioTimer::new())
                        .header_read_timeout(SLOWEST_HEAD)
                        .max_headers(64)
                        .max_buf_size(32 * 1024)
                        .serve_connection(TokioIo::new(stream), service);
                    // How it ended matters to nobody: the page asks again.
                    let _ = tokio::time::timeout(LONGEST, connection).await;
                    drop(place);
                });
            }
        })
    }
}

/// A model's file as seen from the study's folder.
fn in_folder(folder: &std::path::Path, model: PathBuf) -> Result<String> {
    let whole = model.canonicalize().map_err(|e| {
        Error::failed(format!(
            "{}: cannot be read ({e}); name the model that identify or add wrote",
            model.display()
        ))
    })?;
    let relative = whole.strip_prefix(folder).unwrap_or(&whole);
    Ok(relative.to_string_lossy().replace('\\', "/"))
}
