//! What holds a tip to the canal: one of four friction laws, and how the static bound falls to the kinetic one.
//!
//! Nobody knows which law a worm's tips obey, so every campaign throws one, with its figures, for all four tips. The laws
//! differ in kind: [`Lugre`] yields from the first micrometre and damps while it does, [`ElastoPlastic`] springs back wholly
//! up to a breakaway displacement, [`Dahl`] has a rounder or a sharper knee than either and no damper, and [`Coulomb`] does
//! not give at all. Independently of the law the bound falls with the tip's speed or with its way ([`Weakening`]).
//!
//! The ranges are log-uniform and come from what was measured, as far as it is about polymers:
//!
//! - Presliding. The stiffness of an interface grows with its load, so the displacement to breakaway is the contact's own
//!   figure, the stiffness's inverse times the friction. Multicontacts of a polymer glass give micrometres: Berthoud and
//!   Baumberger, Proc. R. Soc. A 454 (1998) 1615; Bureau, Caroli and Baumberger, Proc. R. Soc. A 459 (2003) 2787. A rough
//!   elastomer on glass yields elasto-plastically over a length of its roughness: Prevost, Scheibert and Debrégeas, Eur.
//!   Phys. J. E 36 (2013) 17. Armstrong-Hélouvry, Dupont and Canudas de Wit, Automatica 30 (1994) 1083, give up to tens of
//!   micrometres over all materials.
//! - Micro-damping and viscous part, each over its stiffness or force: about what Canudas de Wit, Olsson, Åström and
//!   Lischinsky, IEEE Trans. Autom. Control 40 (1995) 419, calculate with, and less.
//! - Breakaway displacement over the displacement at sliding: about Dupont, Hayward, Armstrong and Altpeter, IEEE Trans.
//!   Autom. Control 47 (2002) 787.
//! - Stribeck speed and frictional lag: amid what Armstrong-Hélouvry et al. list. Slip distance: from the order of the ten
//!   micrometres of Rabinowicz, J. Appl. Phys. 22 (1951) 1373, upward, for soft contacts slip further before their friction
//!   drops, Lorenz and Persson, J. Phys. Condens. Matter 24 (2012) 225008.
//! - Creep below the limit: not above the nanometres per second at which Farain and Bonn, Tribol. Lett. 70 (2022), slid.
//!
//! Two cuts keep a clean worm clean, that is a slow one within about 1 % of the rigid tip's advance on every slope of
//! the paper, and one at its gait's speed within 1 % of the level's advance: presliding ends, for each law at its own
//! place, well below the tens of micrometres that soft contacts may have, and where the worm's truth is not breakaway
//! friction the static bound stands hardly above the kinetic one, though the worm's own sponge has 0.7 to 0.5 (Zarrouk,
//! Sharf and Shoham 2016, section 2). Of Dahl's exponents two are thrown that have a closed form.

use super::bristle::{TipLoad, TipStep};
use super::coulomb::Coulomb;
use super::dahl::{Dahl, Knee};
use super::elasto_plastic::ElastoPlastic;
use super::lugre::Lugre;
use super::weakening::Weakening;
use crate::random::log_uniform;
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;

/// A friction law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Law {
    Lugre(Lugre),
    ElastoPlastic(ElastoPlastic),
    Dahl(Dahl),
    Coulomb(Coulomb),
}

impl Law {
    /// The way on which pad and friction are in balance at the end of the time step.
    pub fn solve(&self, load: &TipLoad) -> TipStep {
        match self {
            Self::Lugre(law) => law.solve(load),
            Self::ElastoPlastic(law) => law.solve(load),
            Self::Dahl(law) => law.solve(load),
            Self::Coulomb(law) => law.solve(load),
        }
    }
}

/// How tips hold to the canal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    pub law: Law,
    /// Bend at which a bristle carries the tip's kinetic friction, m.
    pub presliding_m: f64,
    /// Friction limit of a tip at rest over that of a sliding one where nothing is hidden.
    pub static_over_kinetic: f64,
    /// How the limit falls from the one to the other.
    pub weakening: Weakening,
}

impl Contact {
    /// Tips that hold at their limit and hardly move below it.
    pub fn rigid() -> Self {
        Self {
            law: Law::Coulomb(Coulomb {
                creep_m_s: 1e-10,
                drag_s_per_m: 0.0,
            }),
            presliding_m: 1e-6,
            static_over_kinetic: 1.0,
            weakening: Weakening::Slip {
                drop_m: 0.1e-3,
                restored_s: 0.010,
            },
        }
    }

    /// A contact as one finds them.
    pub fn draw(rng: &mut Xoshiro256PlusPlus) -> Self {
        let (damping_s, drag_s_per_m) = (log_uniform(0.1e-3, 1e-3, rng), log_uniform(0.005, 0.05, rng));
        // With each law the most presliding that leaves a clean worm clean, m.
        let (law, max_m) = match rng.random_range(0..5) {
            0 => {
                let law = Lugre {
                    damping_s,
                    drag_s_per_m,
                };
                (Law::Lugre(law), 3.5e-6)
            }
            1 => {
                let law = ElastoPlastic {
                    breakaway_fraction: log_uniform(0.3, 0.9, rng),
                    damping_s,
                    drag_s_per_m,
                };
                (Law::ElastoPlastic(law), 4e-6)
            }
            2 => (Law::Dahl(Dahl { knee: Knee::Sharp }), 5e-6),
            3 => (Law::Dahl(Dahl { knee: Knee::Round }), 1.5e-6),
            _ => {
                let law = Coulomb {
                    creep_m_s: log_uniform(1e-10, 1e-9, rng),
                    drag_s_per_m,
                };
                (Law::Coulomb(law), 1e-6)
            }
        };
        Self {
            law,
            presliding_m: log_uniform(0.5e-6, max_m, rng),
            static_over_kinetic: 1.0 + log_uniform(0.0005, 0.002, rng),
            weakening: Weakening::draw(rng),
        }
    }
}
