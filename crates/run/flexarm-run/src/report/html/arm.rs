//! The arm at the time of the maximum error, with the key of the pictures. Not here: rendering
//! (`picture`).

use std::fmt::Write as _;

use base64::Engine as _;
use flexarm_draw::palette::hex;
use flexarm_log::RunHeader;

use super::figures::lies_on_twin;
use super::number::{number, short};
use super::run::ReportRun;
use crate::report::picture::{pictures, scale_colors};
use flexarm_settings::written::markup;

/// Width of the pictures of the arm (pixels), larger than displayed on the page, where two are side
/// by side.
const PICTURE_WIDTH: usize = 810;

/// Returns the pictures of each run, or why there are none.
pub(super) fn arm_pictures(runs: &[ReportRun<'_>]) -> String {
    let mut out = "<section id=\"arm\" class=\"block\"><h2>The arm at its peak error</h2>\n".to_owned();
    let with_twin: Vec<_> = runs.iter().filter(|run| run.trace.header.has_rigid).collect();
    if with_twin.is_empty() {
        return String::new();
    }
    for run in &with_twin {
        let header = &run.trace.header;
        let who = if runs.len() > 1 { format!("{}: ", run.label) } else { String::new() };
        let none = if run.trace.peak.flexible.X_WL.is_empty() {
            Some("the recording has no poses of links, so there is no picture of the arm")
        } else if lies_on_twin(run) {
            Some("nothing is flexible: the arm coincides with its rigid twin, so there is no picture of it")
        } else {
            None
        };
        if let Some(why) = none {
            let _ = writeln!(out, "<p class=\"note\">{}{why}</p>", markup(&who));
            continue;
        }
        out += "<div class=\"pictures\">\n";
        // Embedded, so that the page is one file.
        for picture in pictures(run.trace, PICTURE_WIDTH) {
            let caption = format!("{who}{}, at {:.3} s.", picture.title, run.trace.peak.time_s);
            match picture.drawn {
                Ok((png, axes)) => {
                    let data = base64::engine::general_purpose::STANDARD.encode(png);
                    let caption = markup(&caption);
                    let _ = writeln!(
                        out,
                        "<figure><div class=\"arm\"><img alt=\"{caption}\" src=\"data:image/png;base64,{data}\">{}</div>\
                         <figcaption>{caption}</figcaption></figure>",
                        triad(&axes)
                    );
                }
                Err(why) => {
                    let _ = writeln!(out, "<p class=\"note\">{}</p>", markup(&why.to_string()));
                }
            }
        }
        out += "</div>\n";
        out += &picture_key(header);
    }
    out + "</section>\n"
}

/// World axes as projected in a picture; leaves out those that point at the viewer.
fn triad(axes: &[[f64; 2]; 3]) -> String {
    const LENGTH: f64 = 24.0;
    let mut out = "<svg class=\"triad\" viewBox=\"-40 -40 80 80\" aria-hidden=\"true\">".to_owned();
    for (name, [right, up]) in ["x", "y", "z"].into_iter().zip(axes) {
        if right.hypot(*up) < 0.15 {
            continue;
        }
        let at = |length: f64| (short(length * right, 3), short(-length * up, 3));
        let ((x, y), (s, t)) = (at(LENGTH), at(LENGTH + 9.0));
        let _ = write!(
            out,
            "<g style=\"stroke:var(--{name});fill:var(--{name})\"><line x1=\"0\" y1=\"0\" x2=\"{x}\" y2=\"{y}\"/>\
             <text x=\"{s}\" y=\"{t}\">{name}</text></g>"
        );
    }
    out + "</svg>"
}

/// Key of the pictures: colours, magnification, rigid arm and error arrow.
fn picture_key(header: &RunHeader) -> String {
    let factor = if header.magnification > 0.0 { header.magnification } else { 1.0 };
    let how = match factor {
        1.0 => "Deflections as they are".to_owned(),
        _ => format!("Deflections magnified {} times", number(factor, 3)),
    };
    let mut out = format!(
        "<div class=\"key-of-arm\"><p>{how}. <i class=\"ghost\"></i>rigid arm, <i class=\"way\"></i>TCP error, from the rigid tool to the flexible one.</p>"
    );
    let colors: Vec<String> = scale_colors().into_iter().map(hex).collect();
    if header.color_scale_m > 0.0 && !colors.is_empty() {
        let at = |share: f64| number(1e3 * share * header.color_scale_m, 3);
        let _ = write!(
            out,
            "<div class=\"scale\"><p>True deviation from the rigid arm</p>\
             <div style=\"background:linear-gradient(to right,{})\"></div>\
             <p><span>0</span><span>{}</span><span>{} mm</span></p></div>",
            colors.join(","),
            at(0.5),
            at(1.0)
        );
    }
    out + "</div>\n"
}
