//! The library of effects: what can happen to the worm that the paper's theory leaves out.
//!
//! An [`Effect`] says in a sentence and a formula what happens, with which parameters, how it shows in cell positions, what
//! positions cannot distinguish it from (its twins), which experiment does, and where a search for it starts. A [`Setting`] is an
//! effect switched on with values; [`Physics::with`](crate::Physics::with) adds settings to a worm.
//!
//! Each parameter has a *neutral* value, at which the effect does nothing. The first parameter is the *severity*; parameters of
//! shape (a time constant, a place) follow.
//!
//! | file | origin of the effects |
//! |---|---|
//! | `contact` | friction between tips and wall |
//! | `pad` | elasticity of the pads |
//! | `load` | external forces and mass |
//! | `drive` | motor, cam and transmission |
//! | `canal` | slope and surface of the canal |
//! | `sensor` | the measurement, not the worm |
//! | `table` | none: a law that was found and not derived |
//! | `servo` | a servo on a bench: a library of its own, [`SERVO_LIBRARY`] |

mod canal;
mod contact;
mod definition;
mod drive;
mod error;
mod library;
mod load;
mod pad;
mod search;
mod sensor;
mod servo;
mod servo_library;
mod setting;
mod table;

pub use definition::{Effect, MAX_PARAMETERS, Parameter, Scope, Sense, ShapeStarts, Visible};
pub use error::SettingError;
pub use library::{LIBRARY, MOTOR_DROOP, named};
pub use servo_library::{SERVO_LIBRARY, named_of_either, named_of_servo};
pub use setting::Setting;
pub use table::TABLE;
