//! The names of a text log's columns and their units: above the rows, in a row or in columns of
//! their own.

use super::is_blank;
use crate::study::channels::naming::split_unit;
use crate::study::channels::units::is_a_unit;

/// The names, and the units below or within them; `names` are the last lines above the first row,
/// from there upwards.
pub(super) fn heading_and_units(
    mut names: Vec<Vec<String>>,
) -> (Option<Vec<String>>, Vec<Option<String>>) {
    let units = match names.as_slice() {
        [units, heading] if is_row_of_units(units) && !is_row_of_units(heading) => {
            names.remove(0).into_iter().map(bare_unit).collect()
        }
        _ => Vec::new(),
    };
    let heading = names.into_iter().next();
    let mut units: Vec<Option<String>> = units;
    if let Some(names) = heading
        .as_deref()
        .filter(|names| units.is_empty() && is_of_units_alone(names))
    {
        units = names.iter().cloned().map(bare_unit).collect();
    }
    (heading, units)
}

/// Words at which a column holds the unit of the one before it in every row.
const UNIT: [&str; 4] = ["unit", "einheit", "unidad", "unité"];

/// Units with those that columns of their own state, as test stands write `Force,Unit`.
pub(super) fn with_columns_of_units(
    mut units: Vec<Option<String>>,
    names: &[String],
    body: &[&str],
    split_line: &dyn Fn(&str) -> Vec<String>,
) -> Vec<Option<String>> {
    let stated = |place: usize| -> Option<String> {
        // A preface is shorter.
        let mut cells = body
            .iter()
            .filter_map(|line| split_line(line).into_iter().nth(place));
        let unit = cells.next().filter(|cell| is_a_unit(cell))?;
        cells.all(|cell| cell == unit).then_some(unit)
    };
    for (place, name) in names.iter().enumerate().skip(1) {
        let name = name.to_lowercase();
        if UNIT.iter().any(|word| name.starts_with(word))
            && let Some(unit) = stated(place)
        {
            units.resize(units.len().max(place), None);
            units[place - 1].get_or_insert(unit);
        }
    }
    units
}

/// Units with those of a preface line that begins with `Y_Unit_Label` or `Units`: each above its
/// column, or all of them behind that word. `X_Dimension` is LabVIEW's for the first column.
pub(super) fn with_labelled_units(
    mut units: Vec<Option<String>>,
    preface: impl Iterator<Item = Vec<String>>,
    columns: usize,
) -> Vec<Option<String>> {
    let is_unit = |word: &str| UNIT.iter().any(|unit| word.starts_with(unit));
    for mut cells in preface {
        let label = cells[0].to_lowercase();
        if label == "x_dimension" && cells.get(1).is_some_and(|cell| cell == "Time") {
            cells = vec!["s".into()];
        } else if !is_unit(label.trim_start_matches("y_")) || label.contains(' ') {
            continue;
        }
        let filled = cells.iter().rposition(|cell| !cell.is_empty());
        if filled.is_some_and(|last| last >= columns) {
            cells.remove(0);
        }
        units.resize(columns, None);
        for (unit, cell) in units.iter_mut().zip(cells) {
            let is_unit = is_a_unit(bracketed(&cell).unwrap_or(&cell)) && cell != "1";
            if unit.is_none() && is_unit {
                *unit = bare_unit(cell);
            }
        }
    }
    units
}

/// Names columns above which the heading is empty: by its unit where one stands there, and the
/// first column by its place where its first numbers, `firsts`, are no count of the rows, as
/// programs write it in front.
pub(super) fn name_the_unnamed(names: &mut [String], units: &[Option<String>], firsts: &[f64]) {
    let is_count = matches!(firsts, [a, b] if b - a == 1.0);
    for (place, name) in names.iter_mut().enumerate().filter(|(_, n)| n.is_empty()) {
        match units.get(place) {
            Some(Some(unit)) => name.clone_from(unit),
            _ if place == 0 && !is_count && !firsts.is_empty() => "c1".clone_into(name),
            _ => {}
        }
    }
}

/// Comments right above the first row that have as many words as there are columns, from there
/// upwards: how NumPy writes a heading, and others one with units below it.
pub(super) fn commented_heading(
    top: &[(usize, &str)],
    first_line: usize,
    columns: usize,
    split_line: &dyn Fn(&str) -> Vec<String>,
) -> Vec<Vec<String>> {
    let above = top.partition_point(|(number, _)| *number < first_line);
    let comments = top[..above].iter().rev();
    let comments = comments.map(|(_, line)| line.trim_start().trim_start_matches(['#', '%', '/']));
    let words = |comment: &str| {
        let fits = |names: &Vec<String>| names.len() == columns;
        let blanks =
            |text: &str| -> Vec<String> { text.split_whitespace().map(str::to_owned).collect() };
        // Blanks above rows with tabs: names where one of them has a unit, or else words.
        let named = blanks(comment);
        let has_unit = named.iter().any(|name| split_unit(name).1.is_some());
        let mut ways = vec![split_line(comment)];
        ways.extend(has_unit.then_some(named));
        // "# Columns: t x F"
        if let Some((_, names)) = comment.split_once(':') {
            ways.extend([split_line(names.trim()), blanks(names)]);
        }
        ways.into_iter().find(fits)
    };
    let lines = comments
        .filter(|comment| !is_blank(comment))
        .map_while(words);
    let fitting = lines.take_while(|words| columns > 1 && words.len() == columns);
    fitting.take(2).collect()
}

/// Names that stand one below the other in a preface, as many as there are columns, each with its
/// unit: `Speed [deg/s]`.
pub(super) fn listed_heading(above: &[(usize, &str)], columns: usize) -> Option<Vec<String>> {
    let lines: Vec<&str> = above.iter().map(|(_, line)| line.trim()).collect();
    let is_named = |line: &str| {
        let unit = line.rfind(['[', '(']).filter(|at| *at > 0);
        unit.is_some_and(|at| bracketed(&line[at..]).is_some())
    };
    let mut lists = lines.chunk_by(|a, b| is_named(a) == is_named(b));
    let list = lists.rfind(|list| columns > 1 && list.len() == columns && is_named(list[0]))?;
    Some(list.iter().map(|name| (*name).to_owned()).collect())
}

/// “mm”, “[mm]”, “(mm)” and empty cells, at least half of those that are filled: every trade has
/// units of its own.
fn is_row_of_units(cells: &[String]) -> bool {
    let filled = cells.iter().filter(|c| !c.is_empty());
    let units = |c: &&String| bracketed(c).is_some() || is_a_unit(c);
    let known = filled.clone().filter(units).count();
    known > 0 && 2 * known >= filled.count()
}

/// Whether names are nothing but units, of three columns or more, as `s,mm,N`; one letter each may
/// be names as well.
fn is_of_units_alone(names: &[String]) -> bool {
    let unit = |name: &String| is_a_unit(bracketed(name).unwrap_or(name));
    names.len() > 2 && names.iter().all(unit) && names.iter().any(|name| name.chars().count() > 1)
}

fn bracketed(cell: &str) -> Option<&str> {
    let square = cell.strip_prefix('[').and_then(|c| c.strip_suffix(']'));
    let round = cell.strip_prefix('(').and_then(|c| c.strip_suffix(')'));
    square.or(round).map(str::trim)
}

fn bare_unit(cell: String) -> Option<String> {
    let bare = bracketed(&cell).unwrap_or(&cell);
    (!bare.is_empty()).then(|| bare.to_owned())
}
