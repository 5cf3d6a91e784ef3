//! The text next to the views: ties, position of the cut, masses of the parts.
//!
//! Start at [`draw`]. Not here: the views ([`super::interface_sheet`]), formats of numbers
//! ([`super::numbers`]).

use flexarm_fem::reduction::{Interface, Tie};

use super::MeshPictures;
use super::color;
use super::draw::{Align, Style, wrap};
use super::image::{Image, Rgb};
use super::numbers;
use super::sheet::{self, HEAD, HEIGHT, WIDTH};
use super::surface::Tied;
use super::view::side_name;

/// Width of the legend, pixels.
pub(super) const LEGEND: usize = 392;

/// Writes successive lines.
struct Column<'a> {
    sheet: &'a mut Image,
    left: f64,
    y: f64,
}

impl Column<'_> {
    fn line(&mut self, text: &str, style: Style) {
        for line in wrap(text, WIDTH as f64 - self.left - 12.0, style) {
            // A legend that is too long is truncated at the end of the sheet.
            if self.y > HEIGHT as f64 - 10.0 {
                return;
            }
            self.sheet.text(&line, [self.left, self.y], Align::Left, style);
            self.y += style.size * 1.42;
        }
    }

    fn heading(&mut self, text: &str, color: Rgb) {
        self.y += 11.0;
        if self.y <= HEIGHT as f64 - 10.0 {
            sheet::swatch(self.sheet, [self.left - 25.0, self.y], color);
        }
        self.line(text, Style::new(18.0, color::INK).bold());
    }

    /// Writes tie, faces and origin of an interface, and what is wrong with it.
    fn interface(&mut self, interface: &Interface, tied: &Tied, has_solids: bool) {
        let (plain, faint, alert) = styles();
        let tie = match interface.tie {
            Tie::Rigid => "rigid tie (RBE2)",
            Tie::Distributing => "distributing tie (RBE3)",
        };
        self.line(&format!("{tie}, {} node(s)", interface.nodes.len()), plain);
        if tied.faces > 0 {
            self.line(&format!("{} faces, {}, {}", tied.faces, numbers::area(tied.area), shape(tied)), plain);
        }
        let of = if tied.faces > 0 { "faces" } else { "nodes" };
        let origin = interface.X_LI.translation.vector;
        self.line(&format!("origin {}", numbers::position(&origin)), faint);
        self.line(&format!("{} from the centre of the {of}", numbers::offset((tied.centre - origin).norm())), faint);
        if tied.faces == 0 && has_solids {
            self.line("No face of the skin is tied as a whole, only single nodes.", alert);
        }
        if tied.torn > 0 {
            let count = tied.torn;
            self.line(&format!("{count} faces are tied by their corners only, mid-side nodes are loose."), alert);
        }
    }
}

/// Styles of plain, secondary and alerting lines.
fn styles() -> (Style, Style, Style) {
    (Style::new(15.0, color::INK), Style::new(15.0, color::FAINT), Style::new(15.0, color::ALERT).bold())
}

/// Writes the legend on the right side of the sheet.
pub(super) fn draw(sheet: &mut Image, pictures: &MeshPictures<'_>, tied: &[Tied]) {
    let mut column = Column { sheet, left: (WIDTH - LEGEND) as f64 + 46.0, y: HEAD as f64 + 20.0 };
    for (number, (interface, tied)) in pictures.interfaces.iter().zip(tied).enumerate() {
        let role = ["held in the pictures", "loaded in the pictures", "a further interface"][number.min(2)];
        column.heading(&format!("{}: {role}", interface.name), color::interface(number));
        let has_solids = !pictures.surface.features.is_empty() || !pictures.surface.grid.is_empty();
        column.interface(interface, tied, has_solids);
    }

    let (plain, faint, alert) = styles();
    // The cut, as a share of the way from A to B.
    let (reduction, link) = (pictures.reduction, &pictures.reduction.link);
    let p_LS = link.split.X_LS.translation.vector;
    let along = link.p_AB();
    let fraction = along.dot(&(p_LS - link.X_LA.translation.vector)) / along.norm_squared();
    column.heading("S: cut and elastic joint", color::CUT);
    column.line(&format!("at {}", numbers::position(&p_LS)), plain);
    column.line(&format!("{:.0} % of the way from A to B, across AB", 100.0 * fraction), plain);

    // Masses of the parts and of the mesh, and what rides on the link.
    let kilograms = |mass: f64| format!("{} kg", numbers::significant(mass, 4));
    column.heading(&format!("part of A: {}", kilograms(link.proximal.mass)), color::PROXIMAL);
    column.heading(&format!("part of B: {}", kilograms(link.distal.mass)), color::DISTAL);
    column.line(&format!("whole mesh {}", kilograms(reduction.whole.mass)), plain);
    let riding = link.mass() - reduction.whole.mass;
    if riding > 1e-6 * link.mass() {
        column.line(&format!("riding on it {}", kilograms(riding)), plain);
    }
    // Size of the mesh, and warnings.
    column.y += 9.0;
    column.line(&format!("A to B {} mm", numbers::significant(along.norm() * 1e3, 4)), faint);
    let mesh = pictures.mesh;
    column.line(&format!("{} elements, {} nodes", mesh.element_count(), mesh.nodes.len()), faint);
    if !reduction.caveats.is_empty() {
        column.y += 9.0;
        column.line(&format!("{} warning(s) of the reduction:", reduction.caveats.len()), alert);
        for warning in &reduction.caveats {
            column.line(&warning.message, Style::new(13.0, color::ALERT));
        }
    }
}

/// Describes a tied face as flat or curved, and its direction.
fn shape(tied: &Tied) -> String {
    if tied.normal.norm() > 0.999 {
        return format!("flat, facing {}", side_name(&tied.normal));
    }
    "curved or several".into()
}
