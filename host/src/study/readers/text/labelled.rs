//! Text logs in which every cell carries its name, as programs of small boards print them for a
//! plotter: `t:0.03, angle:1.20`.

use super::layout::TOP;
use super::lines;
use std::borrow::Cow;

/// What stands between a name and its number.
const MARKS: [char; 2] = [':', '='];

/// The names in the cells of a log, and its lines with the numbers alone; `None` where less than
/// most of the lines at its top name the same in the same places.
pub(super) fn bared(text: &str) -> Option<(Vec<String>, String)> {
    let top: Vec<&str> = lines(text).take(TOP).map(|(_, line)| line).collect();
    let named = top.get(top.len() / 2).and_then(|line| cells(line))?;
    let names: Vec<&str> = named.iter().map(|(name, _)| *name).collect();
    let is_row =
        |cells: &Vec<(&str, &str)>| cells.iter().map(|(n, _)| *n).eq(names.iter().copied());
    let rows = top.iter().filter_map(|line| cells(line)).filter(is_row);
    if 2 * rows.count() <= top.len() {
        return None;
    }
    // What is no such row stays, so that it is told with its line.
    let bare = |line| match cells(line).filter(is_row) {
        Some(cells) => {
            let numbers: Vec<&str> = cells.iter().map(|(_, number)| *number).collect();
            Cow::Owned(numbers.join("\t"))
        }
        None => Cow::Borrowed(line),
    };
    let bare: Vec<Cow<'_, str>> = text.lines().map(bare).collect();
    Some((
        names.iter().map(|n| (*n).to_owned()).collect(),
        bare.join("\n"),
    ))
}

/// The names and the numbers of a line that holds nothing else.
fn cells(line: &str) -> Option<Vec<(&str, &str)>> {
    let is_between = |c: char| c.is_whitespace() || [',', ';'].contains(&c);
    let mut rest = line.trim_matches(is_between);
    let mut cells = Vec::new();
    while !rest.is_empty() {
        let (name, after) = rest.split_once(MARKS)?;
        let after = after.trim_start();
        let (number, others) = after.split_at(after.find(is_between).unwrap_or(after.len()));
        let is_name = name.starts_with(|c: char| c.is_alphabetic() || c == '_');
        number.parse::<f64>().ok().filter(|_| is_name)?;
        cells.push((name.trim_end(), number));
        rest = others.trim_start_matches(is_between);
    }
    (!cells.is_empty()).then_some(cells)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_before_the_numbers_of_every_row_are_the_heading() {
        for row in [
            "t:0.5, wheel speed:-1e3",
            "t: 0.5\twheel speed: -1e3",
            "t=0.5; wheel speed=-1e3;",
            "t:0.5 wheel speed:-1e3",
        ] {
            let text = format!("ready\n{}t:0.5, whee\n", format!("{row}\r\n").repeat(9));
            let (names, bare) = bared(&text).unwrap();
            assert_eq!(names, ["t", "wheel speed"], "{row}");
            let lines: Vec<&str> = bare.lines().collect();
            assert_eq!(lines[..2], ["ready", "0.5\t-1e3"], "{row}");
            assert_eq!(lines[10], "t:0.5, whee");
        }
        for row in ["0.5,1", "09:26:53,2", "t:a,x:b", "t:mm,x:0.5"] {
            assert_eq!(bared(&format!("{row}\n").repeat(9)), None, "{row}");
        }
        assert_eq!(bared("a: 1\nb: 2\na: 3\nb: 4\n"), None);
    }
}
