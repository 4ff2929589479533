//! Reader of Universal File Format, dataset 58 (function at nodal degree of freedom), ASCII and
//! binary: each real, evenly spaced function is a column, named by its first line of
//! identification; the column `time` is made of the abscissa.

use super::cursor::Number;
use crate::study::log::{Column, Request, Table};
use crate::text::error::{Error, Result};

/// Lines of a dataset before its numbers.
const HEAD: usize = 11;

/// Whether the bytes begin like such a file: a line of −1, then a line with a number.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(400)]).into_owned();
    let mut lines = head.lines().map(str::trim).filter(|l| !l.is_empty());
    let number = |line: &str| {
        line.trim_end_matches('b')
            .split_whitespace()
            .next()
            .is_some_and(|n| n.parse::<u32>().is_ok())
    };
    lines.next() == Some("-1")
        && lines
            .next()
            .is_some_and(|l| l.split_whitespace().next().is_some_and(number))
}

/// Reads the functions that the request needs.
pub(super) fn read(request: &Request<'_>, bytes: &[u8]) -> Result<Table> {
    let mut columns: Vec<Column> = Vec::new();
    let mut time: Option<(usize, f64, f64, String)> = None;
    let mut rest = bytes;
    let mut line = 0;
    while let Some(first) = next_line(&mut rest, &mut line) {
        if first.trim() != "-1" {
            continue;
        }
        let Some(kind) = next_line(&mut rest, &mut line) else {
            break;
        };
        let word = kind.split_whitespace().next().unwrap_or("");
        if word != "58" && word != "58b" {
            // Another dataset: on to the −1 that ends it.
            while next_line(&mut rest, &mut line).is_some_and(|l| l.trim() != "-1") {}
            continue;
        }
        let head: Vec<String> = std::iter::from_fn(|| next_line(&mut rest, &mut line))
            .take(HEAD)
            .collect();
        let at = line;
        let broken = move |what: &str| broken(request, at, what);
        if head.len() < HEAD {
            return Err(broken("a function is cut off in its description"));
        }
        let words = |at: usize| head[at].split_whitespace().collect::<Vec<_>>();
        let form = words(6);
        let [kind_of_data, count, even, start, step, ..] = form.as_slice() else {
            return Err(broken("the line on the form of the data is short"));
        };
        let count: usize = count
            .parse()
            .map_err(|_| broken("the number of values is none"))?;
        let number = |text: &str| {
            text.parse::<f64>()
                .map_err(|_| broken("the abscissa's step is no number"))
        };
        let (start, step) = (number(start)?, number(step)?);
        let values = if word == "58b" {
            binary(&kind, &mut rest, kind_of_data, *even == "1", count).map_err(broken)?
        } else {
            ascii(&mut rest, &mut line, kind_of_data, *even == "1", count).map_err(broken)?
        };
        // Complex functions are spectra, not logs.
        let Some(values) = values else { continue };
        let label = head[0].trim().to_owned();
        let taken = columns.iter().filter(|c| c.name == label).count();
        let name = if taken > 0 {
            format!("{label}[{}]", columns.len() + 1)
        } else {
            label
        };
        let unit = head[8]
            .split_whitespace()
            .last()
            .map(str::to_owned)
            .filter(|u| u != "NONE");
        columns.push(Column {
            values: request.needs(&name).then_some(values),
            name,
            unit: unit.filter(|_| head[8].split_whitespace().count() > 5),
        });
        let unit = head[7].split_whitespace().last().unwrap_or("s").to_owned();
        time.get_or_insert((count, start, step, unit));
    }
    let Some((count, start, step, unit)) = time else {
        return Err(request.error(
            "is a Universal File without a real function (dataset 58); export the time histories",
        ));
    };
    columns.push(Column {
        name: "time".into(),
        unit: (unit != "NONE").then_some(unit),
        values: request
            .needs("time")
            .then(|| (0..count).map(|i| start + i as f64 * step).collect()),
    });
    Ok(Table::whole("Universal File 58", columns))
}

fn broken(request: &Request<'_>, line: usize, what: &str) -> Error {
    request.error_in(
        &crate::study::log::line_name(line),
        format!("{what}; the file was cut off or damaged, export it again"),
    )
}

/// The next line, and its number.
fn next_line(rest: &mut &[u8], line: &mut usize) -> Option<String> {
    if rest.is_empty() {
        return None;
    }
    let end = rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len());
    let text = String::from_utf8_lossy(&rest[..end])
        .trim_end_matches('\r')
        .to_owned();
    *rest = rest.get(end + 1..).unwrap_or(&[]);
    *line += 1;
    Some(text)
}

type Values = std::result::Result<Option<Vec<f64>>, &'static str>;

/// Numbers in columns of a fixed width, of which uneven spacing puts an abscissa before each.
fn ascii(rest: &mut &[u8], line: &mut usize, kind: &str, even: bool, count: usize) -> Values {
    let mut all = Vec::new();
    let parts = if matches!(kind, "5" | "6") { 2 } else { 1 } + usize::from(!even);
    let wanted = count
        .checked_mul(parts)
        .ok_or("the number of values is none")?;
    while all.len() < wanted {
        let Some(text) = next_line(rest, line) else {
            return Err("the values end too early");
        };
        if text.trim() == "-1" {
            return Err("there are fewer values than announced");
        }
        // Fields may touch: “-1.0E+00-2.0E+00”.
        let mut start = 0;
        let bytes = text.as_bytes();
        for at in 1..=bytes.len() {
            let sign = at < bytes.len()
                && bytes[at] == b'-'
                && !matches!(bytes[at - 1], b'e' | b'E' | b' ' | b'd' | b'D');
            if at == bytes.len() || bytes[at] == b' ' || sign {
                let word = text[start..at].trim();
                if !word.is_empty() {
                    all.push(
                        word.replace(['D', 'd'], "e")
                            .parse()
                            .map_err(|_| "a value is no number")?,
                    );
                }
                start = at;
            }
        }
    }
    while next_line(rest, line).is_some_and(|l| l.trim() != "-1") {}
    if !even || parts > 1 {
        return Ok(None);
    }
    all.truncate(count);
    Ok(Some(all))
}

/// Raw numbers; the line of the dataset's type says their order and how many bytes there are.
fn binary(kind: &str, rest: &mut &[u8], data: &str, even: bool, count: usize) -> Values {
    let words: Vec<&str> = kind.split_whitespace().collect();
    let [_, order, format, _, bytes, ..] = words.as_slice() else {
        return Err("the line of the dataset's type is short");
    };
    if *format != "2" {
        return Err("its binary numbers are not IEEE 754");
    }
    let length: usize = bytes.parse().map_err(|_| "the number of bytes is none")?;
    let (raw, after) = rest
        .split_at_checked(length)
        .ok_or("the values end too early")?;
    *rest = after;
    if let Some(end) = rest.windows(2).take(200).position(|w| w == b"-1") {
        *rest = &rest[end + 2..];
    }
    let size = match data {
        "2" => 4,
        "4" => 8,
        _ => return Ok(None),
    };
    if !even {
        return Ok(None);
    }
    if count
        .checked_mul(size)
        .is_none_or(|needed| needed > raw.len())
    {
        return Err("there are fewer values than announced");
    }
    let number = Number {
        float: true,
        signed: true,
        big_endian: *order == "2",
        size,
    };
    let values = raw.chunks_exact(size).take(count);
    Ok(Some(values.map(|raw| number.value(raw)).collect()))
}
