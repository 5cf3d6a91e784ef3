//! Gmsh `.msh` files, versions 2 and 4.1, as text and binary.
//!
//! Both versions fill a [`Collector`]: volumes by physical group, nodes of the groups of lower
//! dimension. Start at [`parse`]. Layout: Gmsh reference manual, "Gmsh file formats".

pub(crate) mod collector;
mod msh2;
mod msh4;
mod reader;
pub(crate) mod shapes;

use super::read::{MeshFile, ReadOptions};
use super::source::Source;
use crate::FeFileError;
use crate::number::shown;
use collector::Collector;
use reader::{Layout, Reader};

/// Reads a whole file.
pub(super) fn parse(src: &Source, options: &ReadOptions) -> Result<MeshFile, FeFileError> {
    let mut reader = Reader { src: *src, pos: 0, layout: Layout::Ascii };
    let mut version = None;
    let mut collector = Collector::new(!options.beams.is_empty());
    while let Some((section, at)) = next_section(&mut reader) {
        // Sections in any order, the format first; unknown ones are skipped.
        match (section, version) {
            (b"MeshFormat", _) => version = Some(mesh_format(&mut reader)?),
            (b"PhysicalNames", _) => {
                // Also text in binary files.
                let mut text = Reader { layout: Layout::Ascii, ..reader };
                collector.physical_names(&mut text)?;
                reader = Reader { layout: reader.layout, ..text };
            }
            (b"Nodes" | b"Elements" | b"Entities", None) | (b"NOD" | b"ELM", _) => {
                let error = src.error(at, "format", format!("${}", shown(section)), "$MeshFormat first");
                return Err(error.help("MSH 1 is not read: save as version 4.1 or 2.2"));
            }
            (b"PartitionedEntities", _) => {
                let error = src.error(at, "mesh", "$PartitionedEntities", "a mesh in one piece");
                return Err(error.help("in Gmsh use UnpartitionMesh and save again"));
            }
            (b"Entities", Some(4)) => msh4::entities(&mut reader, &mut collector)?,
            (b"Nodes", Some(4)) => msh4::nodes(&mut reader, &mut collector)?,
            (b"Elements", Some(4)) => msh4::elements(&mut reader, &mut collector)?,
            (b"Nodes", Some(_)) => msh2::nodes(&mut reader, &mut collector)?,
            (b"Elements", Some(_)) => msh2::elements(&mut reader, &mut collector)?,
            _ => {
                skip_section(&mut reader, section);
                continue;
            }
        }
        let name = String::from_utf8_lossy(section);
        reader.end_of(&name)?;
    }

    let Some(version) = version else {
        return Err(src.error_in_file("format", "no $MeshFormat", "a Gmsh mesh"));
    };
    let src = reader.src;
    let (mesh, warnings) = collector.finish(&src, options)?;
    let format = match (version, src.binary) {
        (4, false) => "Gmsh MSH 4.1 text",
        (4, true) => "Gmsh MSH 4.1 binary",
        (_, false) => "Gmsh MSH 2 text",
        (_, true) => "Gmsh MSH 2 binary",
    };
    Ok(MeshFile { mesh, format, warnings, element_types: Default::default() })
}

/// Moves past the next line `$Name`; returns the name and its position.
fn next_section<'a>(reader: &mut Reader<'a>) -> Option<(&'a [u8], usize)> {
    while reader.left() > 0 {
        reader.skip_blanks();
        let at = reader.pos;
        let name = reader.rest_of_line().strip_prefix(b"$");
        if let Some(name) = name.filter(|name| !name.starts_with(b"End")) {
            return Some((name, at));
        }
    }
    None
}

/// Moves past the line `$End<section>`, or to the end of the file.
fn skip_section(reader: &mut Reader, section: &[u8]) {
    let end = [b"$End", section].concat();
    while reader.left() > 0 {
        let rest = &reader.src.bytes[reader.pos..];
        let Some(dollar) = rest.iter().position(|byte| *byte == b'$') else {
            reader.pos = reader.src.bytes.len();
            return;
        };
        reader.pos += dollar + 1;
        if rest[dollar..].starts_with(&end) {
            reader.rest_of_line();
            return;
        }
    }
}

/// Reads `version file-type data-size` and, in binary files, the integer 1 that shows the byte
/// order. Returns the version, 2 or 4.
fn mesh_format(reader: &mut Reader) -> Result<u8, FeFileError> {
    let at = reader.pos;
    let version_word = reader.word("version")?;
    let version = match version_word {
        b"2" | b"2.0" | b"2.1" | b"2.2" => 2,
        b"4.1" => 4,
        _ => {
            let found = shown(version_word);
            let error = reader.src.error(at, "version of the MSH format", found, "2.2 or 4.1");
            return Err(error.help("in Gmsh set Mesh.MshFileVersion=4.1 and save again"));
        }
    };
    let file_type = reader.int("file type")?;
    let size = reader.int("data size")?;
    if !matches!((file_type, size, version), (0, ..) | (1, 8, _) | (1, 4, 4)) {
        let found = format!("file type {file_type}, data size {size}");
        let expected = "file type 0 or 1 and data size 8, or 4 in version 4.1";
        return Err(reader.src.error(at, "$MeshFormat", found, expected));
    }
    if file_type == 1 {
        // The integer 1 has its other end first if the byte order differs.
        reader.rest_of_line();
        reader.src.binary = true;
        reader.layout = Layout::Binary { big_endian: false, size: size as usize };
        let one = reader.int("the integer one")?;
        let big_endian = one == i64::from(1_i32.swap_bytes());
        if one != 1 && !big_endian {
            let expected = "1 in one of the two byte orders";
            let error = reader.src.error(at, "byte order", one.to_string(), expected);
            return Err(error.help("was the file transferred as text?"));
        }
        reader.layout = Layout::Binary { big_endian, size: size as usize };
    }
    Ok(version)
}
