//! A film for each camera: what it saw, and the outline of the body found.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::Context;
use body::{BodyModel, Posed, Shape};
use model::{Camera, Silhouette};
use shape_fit::Fit;
use tracking::Tracked;
use video::{FrameWriter, WriteOptions};
use vision::Topology;

use super::say_written;
use crate::evaluate::{
    capture::Folder,
    overlay::{drawn, overlay},
};

pub struct Film<'a> {
    model: &'a BodyModel,
    shape: Shape,
    topology: Topology,
    posed: Posed,
    writers: Vec<(PathBuf, FrameWriter)>,
}

impl<'a> Film<'a> {
    /// Begins CAMERA.mp4 of every camera in a folder.
    pub fn create(
        to: &Path,
        model: &'a BodyModel,
        start: &Fit,
        folder: &Folder,
        rate: f64,
    ) -> anyhow::Result<Self> {
        fs::create_dir_all(to).with_context(|| format!("cannot make {}", to.display()))?;
        let options = WriteOptions { rate, ..WriteOptions::default() };
        let begin = |camera: &Camera| {
            let path = to.join(format!("{}.mp4", camera.name));
            let writer = FrameWriter::create(&path, camera.size, &options)?;
            Ok((path, writer))
        };
        Ok(Self {
            model,
            shape: model.shape(&start.alpha),
            topology: Topology::new(model.faces(), model.num_vertices()),
            posed: Posed::default(),
            writers: folder.cameras.iter().map(begin).collect::<anyhow::Result<_>>()?,
        })
    }

    /// Adds a frame to every film.
    pub fn add(
        &mut self,
        folder: &Folder,
        frame: u32,
        views: &[(Camera, Silhouette)],
        tracked: &Tracked,
    ) -> anyhow::Result<()> {
        self.shape.pose(self.model, &tracked.pose, &mut self.posed);
        for (index, ((camera, silhouette), (_, writer))) in views.iter().zip(&mut self.writers).enumerate() {
            let body = drawn(camera, &self.topology, &self.posed.vertices);
            writer.write(&overlay(folder.picture(index, frame)?, silhouette, &body))?;
        }
        Ok(())
    }

    /// Waits until the films are whole.
    pub fn finish(self) -> anyhow::Result<()> {
        for (path, writer) in self.writers {
            writer.finish()?;
            say_written(&path);
        }
        Ok(())
    }
}
