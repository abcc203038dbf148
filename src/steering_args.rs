//! What the user typed about how the descent is to go.

use clap::Args;

use seamwise::error::Result;
use seamwise::steering::Steering;

/// Options of `seamwise bake` that steer the descent.
#[derive(Debug, Args)]
#[command(next_help_heading = "Steering the descent")]
pub(crate) struct SteeringArgs {
    /// Leave all points of this material as they are; may be given more than once.
    #[arg(long, value_name = "NAME")]
    lock_material: Vec<String>,
    /// Leave all points as they are where this vertex attribute, of one component, is above 0.5.
    #[arg(long, value_name = "NAME")]
    lock_attribute: Option<String>,
}

impl SteeringArgs {
    /// What these arguments mean.
    pub(crate) fn resolve(&self) -> Result<Steering> {
        Ok(Steering {
            lock_materials: self.lock_material.clone(),
            lock_attribute: self.lock_attribute.clone(),
        })
    }
}
