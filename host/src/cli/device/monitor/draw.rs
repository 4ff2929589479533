//! The screen of `jointwatch monitor`: a live view drawn with characters.

use crate::device::live::{
    AxisPicture, COLUMN_S, Column, Counter, Happened, LiveView, Picture, SHOWN_S, Trace,
};
use crate::text::table::rounded;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Axis, Block, Borders, Chart, Dataset, GraphType, Paragraph, Wrap};
use std::time::Duration;

/// Rows below which sensors, counters and events give way to the plots.
const LOW: u16 = 26;
const MEASURED: Color = Color::Cyan;
const PREDICTED: Color = Color::Yellow;
const RESIDUAL: Color = Color::Magenta;

/// Draws everything; `held`: the picture is held still while the device goes on.
pub(super) fn draw(frame: &mut Frame, view: &LiveView, now: Duration, held: bool) {
    let picture = view.picture(now);
    let axes = picture.axes.len().max(1) as u16;
    let alarm = u16::from(picture.alarm.is_some());
    let lower = if frame.area().height < LOW { 0 } else { 9 };
    let [top, told, plots, bottom, foot] = Layout::vertical([
        Constraint::Length(3 + alarm),
        Constraint::Length(2 * axes),
        Constraint::Min(4),
        Constraint::Length(lower),
        Constraint::Length(1),
    ])
    .areas(frame.area());
    head(frame, top, &picture);
    axis_lines(frame, told, &picture);
    draw_plots(frame, plots, view, &picture);
    if lower > 0 {
        below(frame, bottom, view, &picture);
    }
    let keys = if held {
        "held still · space goes on · q quits"
    } else {
        "q quits · space holds still"
    };
    let legend = Line::from(vec![
        Span::raw(format!(" {keys}   ")),
        Span::styled("measured ", MEASURED),
        Span::styled("predicted ", PREDICTED),
        Span::styled("residual", RESIDUAL),
    ]);
    frame.render_widget(legend, foot);
}

fn colour(state: &str) -> Color {
    match state {
        "healthy" => Color::Green,
        "suspect" => Color::Yellow,
        "alarm" => Color::Red,
        "silent" => Color::Magenta,
        _ => Color::Gray,
    }
}

/// The joint in one word, why, and where that comes from.
fn head(frame: &mut Frame, area: Rect, picture: &Picture) {
    let word = Style::new()
        .fg(Color::Black)
        .bg(colour(&picture.state))
        .add_modifier(Modifier::BOLD);
    let state = format!("  {}  ", picture.state.to_uppercase());
    let mut lines = vec![
        Line::from(vec![
            Span::styled(state, word),
            Span::raw("  "),
            Span::raw(picture.reason.clone()),
        ]),
        Line::from(format!(" {}", whence(picture))),
    ];
    if let Some(alarm) = &picture.alarm {
        let style = Style::new().fg(Color::Red).add_modifier(Modifier::BOLD);
        lines.push(Line::styled(format!(" ALARM {alarm}"), style));
    }
    let device = picture.device.as_deref().unwrap_or("no introduction yet");
    let dim = Style::new().add_modifier(Modifier::DIM);
    lines.push(Line::styled(format!(" {device}"), dim));
    frame.render_widget(Paragraph::new(lines), area);
}

/// The line, the device's time, and how fast that runs where it is no real one.
fn whence(picture: &Picture) -> String {
    let mut text = picture.line.clone();
    if let Some(time) = picture.time_s {
        text += &format!(" · {time:.1} s since its start");
    }
    if let Some(speed) = picture.speed {
        text += &format!(" · {speed:.2} × real time");
    }
    text
}

/// Two lines for each axis: its verdict with age, and how far it is from its limit.
fn axis_lines(frame: &mut Frame, area: Rect, picture: &Picture) {
    let mut lines = Vec::new();
    for axis in &picture.axes {
        let state = Style::new()
            .fg(colour(&axis.state))
            .add_modifier(Modifier::BOLD);
        let age = axis.age_s.map_or("?".into(), |age| format!("{age:.1} s"));
        lines.push(Line::from(vec![
            Span::raw(format!(" {:<5}", axis.name)),
            Span::styled(format!("{:<11}", axis.state), state),
            Span::raw(format!(
                "{}; judged {age} ago, {:.0} % of the recent time",
                axis.reason, axis.judged_percent
            )),
        ]));
        lines.push(Line::from(format!("       {}", figures(axis))));
    }
    frame.render_widget(Paragraph::new(lines), area);
}

/// An axis's error, its distance from its limit, and its last forces.
fn figures(axis: &AxisPicture) -> String {
    let limit = match axis.limit_percent {
        Some(percent) => format!("change {} {percent:.0} % of its limit", bar(percent)),
        None => format!("change {} below 75 % of its limit", bar(0.0)),
    };
    let percent = |nmse: Option<f64>| nmse.map_or("–".into(), |n| format!("{n:.3} %"));
    let [fast, slow] = axis.nmse_percent.map(percent);
    let mut text = format!("{limit} · NMSE {fast} fast, {slow} slow");
    if let Some([measured, predicted, residual]) = axis.forces {
        let force = |value: f64| format!("{} {}", rounded(value), axis.unit);
        text += &format!(
            " · measured {}, predicted {}, residual {}",
            force(measured),
            force(predicted),
            force(residual)
        );
    }
    text
}

/// Ten cells for up to one and a half limits, the limit marked.
fn bar(percent: f64) -> String {
    let filled = (percent / 15.0).round() as usize;
    let cell = |at: usize| match at {
        7 => '|',
        at if at < filled => '█',
        _ => '·',
    };
    (0..10).map(cell).collect()
}

/// Forces above, residuals below, the axes side by side.
fn draw_plots(frame: &mut Frame, area: Rect, view: &LiveView, picture: &Picture) {
    let traces = view.traces();
    let drawn = traces.iter().any(|t| t.columns().next().is_some());
    if !drawn {
        let text = "No samples yet. A device sends them when asked, or while its line is fast enough (--stream N).";
        let block = Block::new().borders(Borders::TOP).title(" force ");
        let words = Paragraph::new(text).wrap(Wrap { trim: true }).block(block);
        frame.render_widget(words, area);
        return;
    }
    let columns = Layout::horizontal(vec![Constraint::Fill(1); traces.len()]).split(area);
    for ((trace, area), axis) in traces.iter().zip(columns.iter()).zip(&picture.axes) {
        let [upper, lower] =
            Layout::vertical([Constraint::Fill(3), Constraint::Fill(2)]).areas(*area);
        let force = format!(" force of {}, {} ", axis.name, axis.unit);
        let (measured, predicted) = (
            points(trace, |c| c.measured),
            points(trace, |c| c.predicted),
        );
        let curves = [(&measured[..], MEASURED), (&predicted[..], PREDICTED)];
        plot(frame, upper, force, &curves);
        let residual = points(trace, |c| c.residual);
        let title = format!(" residual of {}, {} ", axis.name, axis.unit);
        plot(frame, lower, title, &[(&residual[..], RESIDUAL)]);
    }
}

/// Least and largest of each column, over seconds before the newest.
fn points(trace: &Trace, of: impl Fn(&Column) -> [f64; 2]) -> Vec<(f64, f64)> {
    let newest = trace.columns().next_back().map_or(0, |c| c.at);
    let both = |column: &Column| {
        let time = -((newest - column.at.min(newest)) as f64) * COLUMN_S;
        of(column).map(|value| (time, value))
    };
    trace.columns().flat_map(both).collect()
}

fn plot(frame: &mut Frame, area: Rect, title: String, curves: &[(&[(f64, f64)], Color)]) {
    let values = curves.iter().flat_map(|(curve, _)| curve.iter());
    let most = values.fold(0.0_f64, |most, (_, value)| most.max(value.abs()));
    let most = if most > 0.0 { 1.05 * most } else { 1.0 };
    let sets = curves.iter().map(|(curve, colour)| {
        Dataset::default()
            .marker(Marker::Braille)
            .graph_type(GraphType::Line)
            .style(*colour)
            .data(curve)
    });
    let label = |value: f64| Line::from(rounded(value));
    let chart = Chart::new(sets.collect())
        .block(Block::new().borders(Borders::TOP).title(title))
        .x_axis(
            Axis::default()
                .bounds([-SHOWN_S, 0.0])
                .labels([format!("−{SHOWN_S:.0} s"), "now".into()]),
        )
        .y_axis(Axis::default().bounds([-most, most]).labels([
            label(-most),
            label(0.0),
            label(most),
        ]));
    frame.render_widget(chart, area);
}

/// Sensors, counters, and what happened.
fn below(frame: &mut Frame, area: Rect, view: &LiveView, picture: &Picture) {
    let [sensors, counters, events] = Layout::horizontal([
        Constraint::Percentage(28),
        Constraint::Length(32),
        Constraint::Min(20),
    ])
    .areas(area);
    let block = |title| Block::new().borders(Borders::TOP).title(title);
    let paragraph = |lines: Vec<Line<'static>>, title| Paragraph::new(lines).block(block(title));

    frame.render_widget(paragraph(sensor_lines(picture), " sensors "), sensors);
    let red = Style::new().fg(Color::Red);
    let counted = |c: &Counter| {
        let style = if c.bad && c.count > 0 {
            red
        } else {
            Style::new()
        };
        Line::styled(format!("{:>9} {}", c.count, c.what), style)
    };
    let all = picture.counters.iter().filter(|c| c.count > 0 || !c.bad);
    let lines: Vec<Line> = all.map(counted).collect();
    frame.render_widget(paragraph(lines, " counters "), counters);

    let room = usize::from(area.height.saturating_sub(1));
    let mut newest: Vec<Line> = view.happened().rev().take(room).map(event).collect();
    newest.reverse();
    frame.render_widget(paragraph(newest, " events "), events);
}

/// Troubled channels first, then how many are well; and the time outside the range.
fn sensor_lines(picture: &Picture) -> Vec<Line<'static>> {
    let (mut lines, mut well) = (Vec::new(), 0);
    for sensor in &picture.sensors {
        match &sensor.trouble {
            Some(trouble) => {
                let style = Style::new().fg(Color::Red);
                lines.push(Line::styled(format!(" {}: {trouble}", sensor.name), style));
            }
            None => well += 1,
        }
    }
    let all = picture.sensors.len();
    if all > 0 {
        lines.push(Line::from(format!(" {well} of {all} channels well")));
    }
    if let Some(outside) = picture.outside_percent {
        lines.insert(0, Line::from(format!(" {outside:.1} % outside range")));
    }
    lines
}

fn event(event: &Happened) -> Line<'static> {
    let time = event.time_s.map_or("–".into(), |t| format!("{t:.1} s"));
    Line::from(format!("{time:>9} {}", event.text))
}
