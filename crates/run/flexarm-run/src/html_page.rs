//! Header of HTML pages without scripts.

use flexarm_settings::written::markup;

/// Common style of the pages.
const STYLE: &str = "\
body { font: 15px/1.5 system-ui, sans-serif; max-width: 64rem; margin: 2rem auto; padding: 0 1rem; color: #1c2530; background: #fff }
table { border-collapse: collapse; margin: 1rem 0 } td, th { padding: .25rem .7rem; text-align: right; border-bottom: 1px solid #d8dee6 }
td:first-child, th:first-child { text-align: left } .no { color: #9a5b00 } .note { color: #5a6674 } svg { max-width: 100%; height: auto }
.row { display: flex; flex-wrap: wrap; gap: .5rem; align-items: flex-start }
pre { background: #f3f5f8; padding: .7rem; overflow-x: auto }
";

/// Returns the beginning of a page, up to its heading.
///
/// * `title`: plain text.
/// * `style`: additional style of the page.
pub fn opening(title: &str, style: &str) -> String {
    let title = markup(title);
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n<meta name=\"generator\" content=\"flexarm {}\">\n\
         <title>{title}</title>\n<style>{STYLE}{style}</style></head>\n<body>\n<h1>{title}</h1>\n",
        env!("CARGO_PKG_VERSION")
    )
}
