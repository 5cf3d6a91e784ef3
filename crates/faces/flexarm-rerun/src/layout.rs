//! Initial layout of the viewer: the robots on the left, plots and text on the right.
//!
//! Written as entities of a blueprint: the SDK's builder (`rerun::blueprint`) cannot set the camera
//! and the background of a 3D view, the legend and the axis of a plot, and the columns of a log.
//!
//! Not here: which views there are (`window`), ranges of axes (`plot_range`).

use rerun::external::re_sdk_types::blueprint::archetypes::{
    Background, ContainerBlueprint, EyeControls3D, PanelBlueprint, PlotLegend, ScalarAxis, TextLogColumns, TimeAxis,
    TimePanelBlueprint, ViewBlueprint, ViewContents, ViewportBlueprint,
};
use rerun::external::re_sdk_types::blueprint::components::{
    BackgroundKind, ColumnShare, ContainerKind, Corner2D, LinkAxis, LoopMode, PanelState, PlayState, RowShare,
    TimelineName,
};
use rerun::external::re_sdk_types::blueprint::datatypes::{TextLogColumn, TextLogColumnKind};
use rerun::{AsComponents, EntityPath};

use super::eye::Eye;
use super::plot_range::{Corner, arrange};
use super::tracks::CurveExtent;

const VIEW_3D: &str = "3D";
const VIEW_PLOT: &str = "TimeSeries";
const VIEW_TEXT: &str = "TextDocument";
const VIEW_LOG: &str = "TextLog";

/// Entities of the blueprint with their components.
pub(crate) type Entities = Vec<(EntityPath, Box<dyn AsComponents>)>;

/// A rectangle of the window.
pub(crate) enum Part {
    /// Parts side by side, with their fractions of the width.
    Row(Vec<(f32, Part)>),
    /// Parts stacked vertically, with their fractions of the height.
    Column(Vec<(f32, Part)>),
    /// Parts as tabs.
    Tabs(Vec<Part>),
    /// A single view.
    View(View),
}

/// A view of entities: kind, title, origin, query.
pub(crate) struct View {
    pub(crate) class: &'static str,
    pub(crate) title: String,
    pub(crate) origin: EntityPath,
    pub(crate) contents: Vec<String>,
}

impl Part {
    /// Creates a 3D view of the entities selected by `contents`.
    pub(crate) fn scene(title: &str, origin: EntityPath, contents: Vec<String>) -> Self {
        Self::View(View { class: VIEW_3D, title: title.to_owned(), origin, contents })
    }

    /// Creates a list of messages.
    pub(crate) fn log(title: &str, origin: EntityPath) -> Self {
        Self::view(VIEW_LOG, title, origin)
    }

    /// Creates a plot of all scalars below `origin`.
    pub(crate) fn plot(title: &str, origin: EntityPath) -> Self {
        Self::view(VIEW_PLOT, title, origin)
    }

    /// Creates a text view.
    pub(crate) fn text(title: &str, origin: EntityPath) -> Self {
        Self::view(VIEW_TEXT, title, origin)
    }

    fn view(class: &'static str, title: &str, origin: EntityPath) -> Self {
        Self::View(View { class, title: title.to_owned(), origin, contents: vec!["$origin/**".to_owned()] })
    }
}

/// Returns the entities of a layout with `root` filling the window, playing on `timeline`, and the
/// places of its plots. Without an eye the viewer chooses a viewpoint.
pub(crate) fn entities(root: &Part, timeline: &str, eye: Option<Eye>) -> (Entities, Vec<PlotPlace>) {
    let mut layout = Layout { entities: Vec::new(), plots: Vec::new(), parts: 0, eye };
    let root_id = layout.add(root).id;
    let viewport = ViewportBlueprint::new().with_root_container(root_id).with_auto_layout(false).with_auto_views(false);
    layout.log("viewport", viewport);
    layout.log("blueprint_panel", PanelBlueprint::new().with_state(PanelState::Collapsed));
    layout.log("selection_panel", PanelBlueprint::new().with_state(PanelState::Collapsed));
    let time = TimePanelBlueprint::new()
        .with_state(PanelState::Collapsed)
        .with_timeline(TimelineName::from(timeline))
        .with_play_state(PlayState::Playing)
        .with_loop_mode(LoopMode::All);
    layout.log("time_panel", time);
    (layout.entities, layout.plots)
}

/// A plot in the layout: origin of its entities, and its path in the blueprint.
#[derive(Clone, Debug)]
pub(crate) struct PlotPlace {
    origin: EntityPath,
    path: String,
}

/// Returns, for each plot, an axis that shows all its curves with labels, and a corner where the
/// legend hides no curve.
pub(crate) fn plot_ranges(plots: &[PlotPlace], extents: &[CurveExtent]) -> Entities {
    let mut entities: Entities = Vec::new();
    for plot in plots {
        let own: Vec<&CurveExtent> = extents.iter().filter(|extent| extent.path.starts_with(&plot.origin)).collect();
        let names: Vec<usize> = own.iter().flat_map(|extent| extent.names.iter().copied()).collect();
        let envelopes: Vec<_> = own.iter().map(|extent| &extent.envelope).collect();
        let Some(arrangement) = arrange(&envelopes, &names) else { continue };
        let corner = match arrangement.corner {
            Corner { left: true, top: true } => Corner2D::LeftTop,
            Corner { left: false, top: true } => Corner2D::RightTop,
            Corner { left: true, top: false } => Corner2D::LeftBottom,
            Corner { left: false, top: false } => Corner2D::RightBottom,
        };
        let at = |what: &str| EntityPath::from(format!("{}/{what}", plot.path).as_str());
        entities.push((at("PlotLegend"), Box::new(PlotLegend::new().with_corner(corner))));
        entities.push((at("ScalarAxis"), Box::new(ScalarAxis::new().with_range(arrangement.range))));
    }
    entities
}

struct Layout {
    entities: Entities,
    plots: Vec<PlotPlace>,
    parts: u8,
    eye: Option<Eye>,
}

/// A part placed in the blueprint.
struct Placed {
    id: rerun::datatypes::Uuid,
    path: String,
}

impl Layout {
    fn log(&mut self, path: &str, what: impl AsComponents + 'static) {
        self.entities.push((EntityPath::from(path), Box::new(what)));
    }

    /// Adds a part and its children.
    fn add(&mut self, part: &Part) -> Placed {
        match part {
            Part::Row(parts) => {
                let shares: Vec<_> = parts.iter().map(|(share, _)| ColumnShare::from(*share)).collect();
                let row = ContainerBlueprint::new(ContainerKind::Horizontal).with_col_shares(shares);
                self.container(row, parts.iter().map(|(_, part)| part))
            }
            Part::Column(parts) => {
                let shares: Vec<_> = parts.iter().map(|(share, _)| RowShare::from(*share)).collect();
                let column = ContainerBlueprint::new(ContainerKind::Vertical).with_row_shares(shares);
                self.container(column, parts.iter().map(|(_, part)| part))
            }
            Part::Tabs(parts) => self.container(ContainerBlueprint::new(ContainerKind::Tabs), parts),
            Part::View(view) => self.view(view),
        }
    }

    fn container<'p>(&mut self, container: ContainerBlueprint, parts: impl IntoIterator<Item = &'p Part>) -> Placed {
        let contents: Vec<_> = parts.into_iter().map(|part| self.add(part).path).collect();
        let placed = self.place("container");
        self.log(&placed.path, container.with_contents(contents.iter().map(String::as_str)));
        placed
    }

    fn view(&mut self, view: &View) -> Placed {
        let placed = self.place("view");
        let contents = ViewContents::new(view.contents.iter().map(String::as_str));
        self.log(&format!("{}/ViewContents", placed.path), contents);
        if view.class == VIEW_PLOT {
            // The time axes of all plots zoom together; the legend gets its final corner once the
            // curves are known ([`plot_ranges`]).
            self.log(&format!("{}/PlotLegend", placed.path), PlotLegend::new().with_corner(Corner2D::LeftTop));
            self.log(&format!("{}/TimeAxis", placed.path), TimeAxis::new().with_link(LinkAxis::LinkToGlobal));
            self.plots.push(PlotPlace { origin: view.origin.clone(), path: placed.path.clone() });
        }
        if view.class == VIEW_LOG {
            // All messages are on one entity, so its path is of no use.
            let column = |kind, visible: bool| TextLogColumn { visible: visible.into(), kind };
            let columns = TextLogColumns::new().with_text_log_columns([
                column(TextLogColumnKind::EntityPath, false),
                column(TextLogColumnKind::LogLevel, true),
                column(TextLogColumnKind::Body, true),
            ]);
            self.log(&format!("{}/TextLogColumns", placed.path), columns);
        }
        if let (VIEW_3D, Some(Eye { position, target })) = (view.class, self.eye) {
            let eye = EyeControls3D::new().with_position(position).with_look_target(target);
            self.log(&format!("{}/EyeControls3D", placed.path), eye);
        }
        if view.class == VIEW_3D {
            // A plain dark background with good contrast to grey, yellow and red.
            let background = Background::new(BackgroundKind::SolidColor).with_color([26, 28, 33]);
            self.log(&format!("{}/Background", placed.path), background);
        }
        let blueprint = ViewBlueprint::new(view.class)
            .with_display_name(view.title.as_str())
            .with_space_origin(view.origin.to_string());
        self.log(&placed.path, blueprint);
        placed
    }

    /// Reserves the next place. The viewer requires identifiers in the form of a random UUID; these
    /// are counted up.
    fn place(&mut self, kind: &str) -> Placed {
        self.parts += 1;
        let mut bytes = [0x40; 16];
        bytes[8] = 0x80;
        bytes[15] = self.parts;
        let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        let uuid = [&hex[..8], &hex[8..12], &hex[12..16], &hex[16..20], &hex[20..]].join("-");
        Placed { id: rerun::datatypes::Uuid { bytes }, path: format!("{kind}/{uuid}") }
    }
}
