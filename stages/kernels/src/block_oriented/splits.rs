//! All divisions of poles and zeros between the two linear parts.

use faer::c64;

use super::model::Structure;
use super::start::{Group, Linear};

/// A division, as roots of either part.
#[derive(Debug, Clone)]
pub(super) struct Split {
    pub structure: Structure,
    /// Poles and zeros of the first part.
    pub first: (Vec<c64>, Vec<c64>),
    /// Poles and zeros of the second part.
    pub second: (Vec<c64>, Vec<c64>),
}

/// Most divisions that are scored.
const MOST: usize = 2000;

/// All divisions of the linear model that the structure has.
///
/// A conjugate pair stays together; no part has more zeros than poles. Of up to `order` poles, real ones are given to
/// both parts too, one at a time, with a zero in one part that cancels it: the linear model of a chain with two like
/// poles has only one of them where the curve's distortion hides the other.
pub(super) fn splits(linear: &Linear, structure: Structure, order: usize) -> Vec<Split> {
    let all = |groups: &[Group]| groups.iter().flatten().copied().collect::<Vec<_>>();
    let (poles, zeros) = (all(&linear.poles), all(&linear.zeros));
    match structure {
        Structure::Wiener => vec![Split { structure, first: (poles, zeros), second: (Vec::new(), Vec::new()) }],
        Structure::Hammerstein => vec![Split { structure, first: (Vec::new(), Vec::new()), second: (poles, zeros) }],
        Structure::WienerHammerstein => {
            let mut found = divided(&linear.poles, &linear.zeros, None);
            let single = |(_, pole): &(usize, &Group)| pole.len() == 1 && poles.len() <= order;
            for (i, pole) in linear.poles.iter().enumerate().filter(single) {
                let mut rest = linear.poles.clone();
                rest.remove(i);
                found.extend(divided(&rest, &linear.zeros, pole.first().copied()));
                if found.len() > MOST {
                    break;
                }
            }
            found.truncate(MOST);
            found
        }
    }
}

fn divided(poles: &[Group], zeros: &[Group], both: Option<c64>) -> Vec<Split> {
    let mut found = Vec::new();
    for own in 0..1_usize << poles.len().min(20) {
        let (mut p1, mut p2) = shared(poles, own);
        p1.extend(both);
        p2.extend(both);
        if p1.is_empty() || p2.is_empty() {
            continue;
        }
        for zeros_own in 0..1_usize << zeros.len().min(20) {
            let (z1, z2) = shared(zeros, zeros_own);
            let ends = match both {
                None => vec![(z1, z2)],
                Some(z) => vec![([z1.clone(), vec![z]].concat(), z2.clone()), (z1, [z2, vec![z]].concat())],
            };
            for (z1, z2) in ends.into_iter().filter(|(z1, z2)| z1.len() <= p1.len() && z2.len() <= p2.len()) {
                let (first, second) = ((p1.clone(), z1), (p2.clone(), z2));
                found.push(Split { structure: Structure::WienerHammerstein, first, second });
            }
            if found.len() > MOST {
                return found;
            }
        }
    }
    found
}

/// The groups whose bit is set, and the others.
fn shared(groups: &[Group], set: usize) -> (Vec<c64>, Vec<c64>) {
    let (own, other): (Vec<_>, Vec<_>) = groups.iter().enumerate().partition(|(i, _)| set >> i & 1 == 1);
    let flat = |groups: Vec<(usize, &Group)>| groups.into_iter().flat_map(|(_, g)| g.clone()).collect();
    (flat(own), flat(other))
}
