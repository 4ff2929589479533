//! Several logs: which of them are the channels of one run.

use super::joined::PLUS;
use super::survey::{Survey, SurveyedColumn};
use crate::text::error::Result;
use std::collections::HashSet;
use std::path::Path;

impl Survey {
    /// Looks at several logs. Those of one length that hold one channel each, of different names or
    /// of none, or of which none has the channels of another, are the channels of one run.
    ///
    /// # Errors
    /// As [`Survey::of`].
    pub fn of_all(paths: &[&Path]) -> Result<Vec<Self>> {
        let all: Vec<Self> = paths.iter().map(|p| Self::of(p)).collect::<Result<_>>()?;
        let is_channel =
            |survey: &Self| survey.measured().count() == 1 && survey.rows == all[0].rows;
        let names = |survey: &Self| survey.columns.iter().map(|c| c.name.clone()).collect();
        let headings: HashSet<Vec<String>> = all.iter().map(names).collect();
        let differ = all[0].states_heading || headings.len() == all.len();
        let are_channels = differ && all.iter().all(is_channel);
        if all.len() < 2 || !are_channels && !Self::are_parts(&all) {
            return Ok(all);
        }
        let files: Vec<&str> = all.iter().map(|survey| survey.file.as_str()).collect();
        Ok(vec![Self::of(Path::new(&files.join(PLUS)))?])
    }

    /// The columns but the time.
    fn measured(&self) -> impl Iterator<Item = &SurveyedColumn> {
        let time = self.time.as_ref().map(|t| t.column.as_str());
        let columns = self.columns.iter();
        columns.filter(move |c| Some(c.name.as_str()) != time)
    }

    /// Whether logs have one length and one time, and none the channels of another, nor force and
    /// displacement by itself as a run in other units would.
    fn are_parts(all: &[Self]) -> bool {
        let time = |s: &Self| s.time.as_ref().and_then(|time| time.seconds(s));
        let times: Vec<Vec<f64>> = all.iter().filter_map(time).collect();
        let shares = |a: &Self, b: &Self| match a.states_heading && b.states_heading {
            true => a.columns.len() == b.columns.len(),
            false => a.measured().any(|c| b.column(&c.name).is_some()),
        };
        let is_whole = |s: &Self| {
            let mut roles = ["force", "displacement"].into_iter();
            roles.all(|role| s.likeliest(role).is_some())
        };
        times.windows(2).all(|pair| pair[0] == pair[1])
            && all.iter().enumerate().all(|(at, log)| {
                let is_apart = !all[..at].iter().any(|other| shares(other, log));
                log.rows == all[0].rows && !is_whole(log) && is_apart
            })
    }
}
