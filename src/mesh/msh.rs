//! Gmsh's files: MSH 2.2 and 4.1.

mod bytes;
mod reading;
mod version2;
mod version4;

use crate::error::MeshError;

use super::elements::Content;

use bytes::Bytes;
use reading::Reading;

/// Reads a file.
pub(super) fn parse(bytes: &[u8]) -> Result<Content, MeshError> {
    let mut bytes = Bytes::new(bytes);
    let mut content = Reading::default();
    let version = header(&mut bytes)?;
    while let Some(name) = bytes.section()? {
        match (name.as_slice(), version) {
            (b"PhysicalNames", _) => content.names(&mut bytes)?,
            (b"Entities", 4) => version4::entities(&mut bytes, &mut content)?,
            (b"PartitionedEntities", 4) => {
                let what = "the mesh is cut into partitions for several machines".to_string();
                return Err(bytes.malformed("PartitionedEntities", what));
            }
            (b"Nodes", 4) => version4::nodes(&mut bytes, &mut content)?,
            (b"Nodes", _) => version2::nodes(&mut bytes, &mut content, false)?,
            (b"ParametricNodes", 2) => version2::nodes(&mut bytes, &mut content, true)?,
            (b"Elements", 4) => version4::elements(&mut bytes, &mut content)?,
            (b"Elements", _) => version2::elements(&mut bytes, &mut content)?,
            // Periodic, NodeData and others, which say nothing of the mesh.
            _ => {
                bytes.skip_to_end_of(&name)?;
                continue;
            }
        }
        bytes.end_of(&name)?;
    }
    ensure!(content.has_elements, MeshError::Truncated { section: "Elements", at: bytes.at() });
    content.finish()
}

/// The format's version, 2 or 4; sets how numbers are written.
fn header(bytes: &mut Bytes<'_>) -> Result<u8, MeshError> {
    let beyond = || MeshError::Version { found: "without $MeshFormat, so none of Gmsh's".to_string() };
    // Comments and other sections may stand before it.
    loop {
        match bytes.section().ok().flatten() {
            Some(name) if name == b"MeshFormat" => break,
            Some(name) => bytes.skip_to_end_of(&name).map_err(|_| beyond())?,
            None => return Err(beyond()),
        }
    }
    bytes.enter("MeshFormat");
    let found = String::from_utf8_lossy(bytes.word()?).into_owned();
    let version = match found.as_str() {
        "2.2" | "2.1" | "2" => 2,
        "4.1" => 4,
        _ => return Err(MeshError::Version { found: format!("MSH {}", found.chars().take(20).collect::<String>()) }),
    };
    let kind = bytes.word()?;
    let size = bytes.word()?;
    if size != b"8" || !matches!(kind, b"0" | b"1") {
        let text = |word: &[u8]| String::from_utf8_lossy(word).chars().take(20).collect::<String>();
        return Err(MeshError::Version { found: format!("MSH {found} {} {}", text(kind), text(size)) });
    }
    if kind == b"1" {
        bytes.binary()?;
    }
    bytes.end_of(b"MeshFormat")?;
    Ok(version)
}
