//! The layout of a text log, guessed from a sample of its lines: separator, decimal sign, heading,
//! row of units, first row.

use super::cells::{Decimal, number};
use super::heading::{
    commented_heading, heading_and_units, listed_heading, name_the_unnamed, with_columns_of_units,
    with_labelled_units,
};
use super::ways::{Separator, best_way, is_value, numeric_columns, split};

/// Lines looked at from the top of the file, where preface and heading are.
pub(super) const TOP: usize = 300;
/// Lines looked at further down, where a column of whole numbers may show its fractions.
pub(super) const FURTHER: usize = 200;

/// How the text is to be read.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Layout {
    pub(super) separator: Separator,
    pub(super) decimal: Decimal,
    /// The column names, when a line holds them.
    pub(super) heading: Option<Vec<String>>,
    /// The line above the rows that holds them.
    pub(super) heading_line: Option<String>,
    /// The units of a row of units, in brackets or not.
    pub(super) units: Vec<Option<String>>,
    /// The line of the file in which the first row of numbers stands; `None` where there is none.
    pub(super) first_line: Option<usize>,
    /// Which cells of the rows hold numbers.
    pub(super) numeric: Vec<bool>,
}

/// Whether a line is a comment, or drawn below a heading.
pub(super) fn is_comment(line: &str) -> bool {
    line.trim_start().starts_with(['#', '%']) || line.starts_with("//") || is_rule(line)
}

/// Whether a line holds nothing but strokes.
fn is_rule(line: &str) -> bool {
    let is_stroke = |c: char| "-=_+|".contains(c) || c.is_whitespace();
    line.chars().all(is_stroke) && ["---", "===", "___"].iter().any(|s| line.contains(s))
}

/// Finds the layout; `top` are the file's first lines, `further` some from its middle and end,
/// blank lines left out.
pub(super) fn guess(top: &[(usize, &str)], further: &[&str]) -> Layout {
    // LabVIEW's measurement files end the head of the file and that of each segment in such a line.
    let is_end = |(_, l): &(usize, &str)| l.trim_start().starts_with("***End_of_Header***");
    let ends = (0..top.len()).filter(|at| is_end(&top[*at]));
    let (head, top) = top.split_at(ends.take(2).last().map_or(0, |at| at + 1));
    let rows: Vec<(usize, &str)> = top
        .iter()
        .copied()
        .filter(|(_, l)| !is_comment(l))
        .collect();
    // Preface lines are at the very top, so the sample's second half speaks of the rows.
    let body: Vec<&str> = rows[rows.len() / 2..]
        .iter()
        .map(|(_, line)| *line)
        .chain(further.iter().copied().filter(|l| !is_comment(l)))
        .collect();
    let ((separator, decimal), columns) = best_way(&body);
    let split_line = |line: &str| -> Vec<String> {
        let mut cells = Vec::new();
        split(line, separator, &mut cells);
        cells.iter().map(|c| (*c).to_owned()).collect()
    };
    let numeric = numeric_columns(&body, (separator, decimal), columns);
    let holds_data = |line: &str| {
        let mut cells = Vec::new();
        split(line, separator, &mut cells);
        let numbers = cells.iter().filter(|c| is_value(c, decimal)).count();
        let kinds = cells.iter().zip(&numeric);
        let words = kinds.filter(|(c, n)| **n && !c.is_empty() && !is_value(c, decimal));
        // Preface lines such as “Run;7;;” are padded to the width of the table, and
        // “Interval;0.0005” has as many cells by itself.
        numbers > 0
            && 2 * numbers >= numeric.iter().filter(|n| **n).count()
            && 2 * words.count() < columns
            && fits(cells.len(), columns)
    };
    let first = (0..rows.len()).find(|i| {
        holds_data(rows[*i].1) && rows.get(i + 1).is_none_or(|(_, next)| holds_data(next))
    });
    let above = &rows[..first.unwrap_or(rows.len().min(1))];
    let names = above
        .iter()
        .rev()
        .map(|(_, line)| split_line(line))
        .take_while(|cells| first.is_none() || fits(cells.len(), columns))
        .take(2)
        .collect();
    let (mut heading, mut units) = heading_and_units(names);
    if let (None, Some(i)) = (&heading, first) {
        let commented = commented_heading(top, rows[i].0, columns, &split_line);
        (heading, units) = heading_and_units(commented);
        heading = heading.or_else(|| listed_heading(above, columns));
    }
    let units = match &heading {
        Some(names) => with_columns_of_units(units, names, &body, &split_line),
        None => units,
    };
    let preface = head.iter().chain(above).map(|(_, line)| split_line(line));
    let units = with_labelled_units(units, preface, columns);
    if let (Some(names), Some(i)) = (&mut heading, first) {
        let cells = rows[i..].iter().take(2).map(|(_, row)| split_line(row));
        let firsts = cells.filter_map(|cells| number(cells.first()?, decimal));
        name_the_unnamed(names, &units, &firsts.collect::<Vec<_>>());
    }
    let is_heading = |line: &&str| heading.as_ref() == Some(&split_line(line));
    let heading_line = above.iter().rev().map(|(_, line)| *line).find(is_heading);
    Layout {
        separator,
        decimal,
        heading_line: heading_line.map(str::to_owned),
        heading,
        units,
        first_line: first.map(|i| rows[i].0),
        numeric,
    }
}

/// Whether most of the columns hold a number or an instant in these cells and the first one no
/// word, as in a row and not in a preface.
pub(super) fn holds_numbers(cells: &[&str], layout: &Layout) -> bool {
    let columns = layout.numeric.len();
    let is_value = |c: &&&str| is_value(c, layout.decimal);
    let is_label = |c: &&str| layout.numeric[0] && !c.is_empty() && !is_value(&c);
    2 * cells.iter().filter(is_value).count() > columns
        && fits(cells.len(), columns)
        && !cells.first().is_some_and(is_label)
}

/// A trailing separator adds an empty cell to the rows or to the heading.
fn fits(cells: usize, columns: usize) -> bool {
    cells.abs_diff(columns) <= 1 && cells > 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guessed(text: &str) -> Layout {
        let lines: Vec<(usize, &str)> = text
            .lines()
            .enumerate()
            .map(|(i, line)| (i + 1, line))
            .filter(|(_, line)| !line.trim().is_empty())
            .collect();
        guess(&lines, &[])
    }

    fn row_repeated(head: &str, row: &str) -> String {
        format!("{head}{}", format!("{row}\n").repeat(20))
    }

    #[test]
    fn separators_decimal_signs_and_headings() {
        use Separator::{Blanks, Char};
        for (head, row, separator, decimal, heading, first) in [
            (
                "t,x,F\n",
                "0.1,2,-3e-4",
                Char(','),
                Decimal::Point,
                "t|x|F",
                2,
            ),
            (
                "t;x;F\n",
                "0,1;2;-3e-4",
                Char(';'),
                Decimal::Comma,
                "t|x|F",
                2,
            ),
            (
                "t;x;F\n",
                "1,234;2,345;3,456",
                Char(';'),
                Decimal::Comma,
                "t|x|F",
                2,
            ),
            (
                "t\tx\tF\n",
                "0,1\t2,5\t3",
                Char('\t'),
                Decimal::Comma,
                "t|x|F",
                2,
            ),
            ("t x F\n", "0.1   2.5 3", Blanks, Decimal::Point, "t|x|F", 2),
            ("# t x F\n", "0.1 2.5 3", Blanks, Decimal::Point, "t|x|F", 2),
            (
                "#time Strain(-) Stress(Pa)\n",
                "0.1\t2.5\t3",
                Char('\t'),
                Decimal::Point,
                "time|Strain(-)|Stress(Pa)",
                2,
            ),
            (
                "Run 7\n\nt;x;F\n",
                "1;2;3",
                Char(';'),
                Decimal::Point,
                "t|x|F",
                4,
            ),
            (
                "\"t\",\"x, far\"\n",
                "0.1,2.5",
                Char(','),
                Decimal::Point,
                "t|x, far",
                2,
            ),
            (
                "Run;7;;\nDate;14.03.2026;;\nt;x;a;F\n",
                "0,1;2;3;4",
                Char(';'),
                Decimal::Comma,
                "t|x|a|F",
                4,
            ),
            ("t,x,\n", "0.1,2.5,", Char(','), Decimal::Point, "t|x|", 2),
            (
                "when,x\n",
                "2026-03-14 09:26:53.5,2.5",
                Char(','),
                Decimal::Point,
                "when|x",
                2,
            ),
            (
                "day;time;x\n",
                "14.03.2026;09:26:53,5;2,5",
                Char(';'),
                Decimal::Comma,
                "day|time|x",
                2,
            ),
        ] {
            let found = guessed(&row_repeated(head, row));
            assert_eq!(
                (found.separator, found.decimal),
                (separator, decimal),
                "{head}{row}"
            );
            assert_eq!(found.heading.unwrap().join("|"), heading, "{head}{row}");
            assert_eq!(found.first_line, Some(first), "{head}{row}");
        }
    }

    #[test]
    fn a_commented_heading_may_have_units_below_it_and_a_heading_strokes() {
        let commented = format!(
            "#Created: today\n#Time A\tPos A\tTime B\n#[s]\t[au]\t[s]\n{}",
            row_repeated("", "0.025\t600\t0.05")
        );
        let layout = guessed(&commented);
        let names = ["Time A", "Pos A", "Time B"].map(str::to_owned);
        assert_eq!(layout.heading.as_deref(), Some(&names[..]));
        assert_eq!(layout.units[0].as_deref(), Some("s"));
        let ruled = row_repeated("t, Angle(deg)\n-------------\n", "0.1, 2.5");
        let names = ["t", "Angle(deg)"].map(str::to_owned);
        assert_eq!(guessed(&ruled).heading.as_deref(), Some(&names[..]));
    }

    #[test]
    fn a_preface_may_name_the_columns_behind_a_colon_or_one_below_the_other() {
        let behind = "# Run: 7\n# Columns: t x F_cell\n#\n";
        let layout = guessed(&row_repeated(behind, "0.1\t2.5\t3"));
        assert_eq!(layout.heading.unwrap(), ["t", "x", "F_cell"]);
        let listed = "Limits (speed [deg/s], torque [mNm]): (1080, 199)\n\n--- Format\nDuty cycle [%]\nSpeed: [deg/s]\n\
                      Time [ms]\n--- Data log\n";
        let layout = guessed(&row_repeated(listed, "0;7572;67"));
        assert_eq!(
            layout.heading.unwrap(),
            ["Duty cycle [%]", "Speed: [deg/s]", "Time [ms]"]
        );
        assert_eq!(layout.separator, Separator::Char(';'));
        // A list of another length names nothing.
        assert_eq!(guessed(&row_repeated(listed, "0;7572;67;5")).heading, None);
    }

    #[test]
    fn a_semicolon_at_the_end_of_a_row_belongs_to_no_cell() {
        let found = guessed(&row_repeated("t,x,F\n", "0.1,2.5,-3;"));
        assert_eq!(found.separator, Separator::Char(','));
        let mut cells = Vec::new();
        split("0.1,2.5,-3;", found.separator, &mut cells);
        assert_eq!(cells, ["0.1", "2.5", "-3"]);
    }

    #[test]
    fn a_row_of_units_is_told_from_a_heading() {
        let with = guessed(&row_repeated("Zeit;Weg;Kraft\n;mm;[kN]\n", "0,1;2,5;3"));
        assert_eq!(with.heading.unwrap(), ["Zeit", "Weg", "Kraft"]);
        assert_eq!(with.units, [None, Some("mm".into()), Some("kN".into())]);
        assert_eq!(with.first_line, Some(3));
        let without = guessed(&row_repeated("a b c\nt;s;m\n", "0,1;2,5;3"));
        assert_eq!(without.heading.unwrap(), ["t", "s", "m"]);
        assert!(without.units.is_empty());
    }

    #[test]
    fn units_that_nobody_knows_and_a_head_of_several_rows_leave_the_names() {
        let mts = guessed(&row_repeated(
            "Running Time\tAxial Force\tCount\nSec\tkN\tsegments\n",
            "0.1\t2.5\t3",
        ));
        assert_eq!(
            mts.heading.unwrap(),
            ["Running Time", "Axial Force", "Count"]
        );
        assert_eq!(mts.units[1], Some("kN".into()));
        let head = "Timestamp,2020-03-16 17:04:51,Timestamp,2020-03-16 17:04:51\nInterval,0.0005,Interval,0.0005\n\
                    Channel name,\"Force\",Channel name,\"Input 1\"\nUnit,\"V\",Unit,\"V\"\n";
        let press = guessed(&row_repeated(head, "0.041,-0.137,0.041,-3.2"));
        assert_eq!(press.heading.unwrap()[1], "Force");
        assert_eq!(press.first_line, Some(5));
    }

    #[test]
    fn a_measurement_file_of_labview_begins_below_its_heads_and_says_its_units_there() {
        let segment = "Channels\t2\t\t\nSamples\t20\t20\t\nY_Unit_Label\tmm\tVolts\nX_Dimension\tTime\tTime\n\
                       Delta_X\t0.001\t0.001\n***End_of_Header***\t\t\n";
        let rows = row_repeated("X_Value\tWeg\tKraft\tComment\n", "0.000000\t1.5\t-3.25");
        let found = guessed(&format!(
            "LabVIEW Measurement\t\nSeparator\tTab\n***End_of_Header***\t\n{segment}{rows}{segment}{rows}"
        ));
        assert_eq!(
            found.heading.unwrap(),
            ["X_Value", "Weg", "Kraft", "Comment"]
        );
        assert_eq!(found.separator, Separator::Char('\t'));
        assert_eq!(found.first_line, Some(11));
        let units = ["s", "mm", "Volts"].map(|unit| Some(unit.to_owned()));
        assert_eq!(found.units, units);
    }

    #[test]
    fn a_preface_may_state_the_units_behind_a_word() {
        for (units, found) in [
            ("Units;s;mm;N", [Some("s"), Some("mm"), Some("N")]),
            ("Einheit;[mm];[N]", [None, Some("mm"), Some("N")]),
            ("Unit under test;A;V", [None; 3]),
        ] {
            let layout = guessed(&row_repeated(&format!("{units}\nRun;7\nt;x;F\n"), "1;2;3"));
            let stated = (0..3).map(|at| layout.units.get(at).and_then(|unit| unit.as_deref()));
            assert_eq!(stated.collect::<Vec<_>>(), found, "{units}");
        }
    }

    #[test]
    fn quoted_numbers_may_have_commas_and_names_may_be_units_alone() {
        let quoted = guessed(&row_repeated("\"t\",\"x\"\n", "\"0,125\",\"-2,5\""));
        assert_eq!(
            (quoted.separator, quoted.decimal),
            (Separator::Char(','), Decimal::Comma)
        );
        let units = guessed(&row_repeated("s,mm,N\n", "0.1,2.5,3"));
        assert_eq!(units.heading.unwrap(), ["s", "mm", "N"]);
        assert_eq!(units.units, ["s", "mm", "N"].map(|u| Some(u.to_owned())));
        let names = guessed(&row_repeated("t,s,m\n", "0.1,2.5,3"));
        assert!(names.units.is_empty());
    }

    #[test]
    fn a_column_without_a_name_is_called_by_its_unit_or_its_place_unless_it_counts_the_rows() {
        let epos = guessed(&row_repeated(
            "Scale:;0;True\n;Velocity;Torque\nms;rpm;%\n",
            "40.0;-3;2.5",
        ));
        assert_eq!(epos.heading.unwrap(), ["ms", "Velocity", "Torque"]);
        let index = |rows: &str| guessed(&format!(",x,f\n{rows}")).heading.unwrap()[0].clone();
        assert_eq!(index("0,1.5,2.5\n1,1.6,2.4\n2,1.7,2.3\n"), "");
        assert_eq!(index("0.0,1.5,2.5\n0.1,1.6,2.4\n0.2,1.7,2.3\n"), "c1");
    }

    #[test]
    fn numbers_alone_have_no_heading() {
        let found = guessed(&row_repeated("", "0.1,2.5,3"));
        assert_eq!((found.heading, found.first_line), (None, Some(1)));
    }
}
