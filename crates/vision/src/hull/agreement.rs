use model::Silhouette;
use nalgebra::Vector3;

use super::{
    HullOptions,
    cone::{Cone, Verdict},
    cube::Cube,
};

/// How a view agrees with the others.
///
/// The hull of silhouettes that fit together fills every one of them. A view that lost a limb, or whose calibration is wrong,
/// carves away what the other views' silhouettes show. So the hull is carved coarsely (cells of 2 cm), and each view is asked
/// how much more of any other silhouette would be filled without it, as a share of that silhouette's area. The view with the
/// largest such share disagrees if that is above 0.02. Where the cameras stand doesn't matter: a
/// good view may carve much, but nothing that the others show in the end. When a view is left out, the others are asked again
/// without it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Agreement {
    /// volume that all other views keep and this one carves away, as a share of the largest hull of all views but one
    pub carved_alone: f64,
    /// share of another view's silhouette that the hull fills without this view and doesn't with it, the largest of all
    /// other views
    pub unexplained: f64,
    /// share of its own silhouette that the coarse hull fills, with this view in it: near 1 if all views fit together. Where
    /// it is low, this view or several others are wrong, or there is more than one person
    pub filled: f64,
    /// it disagreed with the others and was not used
    pub is_left_out: bool,
}

/// Share of another silhouette from which on a view disagrees: less than an arm.
const DISAGREES: f64 = 0.02;

/// Cells of the coarse carving, metres.
const COARSE_M: f64 = 0.02;
/// Coarse cells that half a side of the cube to be carved has at most: a calibration in another unit makes it huge.
const MOST_CELLS_A_SIDE: f64 = 128.0;

/// What coarse carving tells.
pub(super) struct Coarse {
    /// of every cone
    pub agreement: Vec<Agreement>,
    /// the cone that disagrees most, if one does
    pub worst: Option<usize>,
    /// least and most coordinates of the hull, if there is any
    pub bounds: Option<[Vector3<f64>; 2]>,
}

struct Carving<'a> {
    cones: &'a [Cone],
    tolerated: usize,
    /// what all keep
    kept: Vec<Cube>,
    /// what all but this one keep
    kept_by_others: Vec<Vec<Cube>>,
    bounds: Option<[Vector3<f64>; 2]>,
}

pub(super) fn carve_coarsely(cones: &[Cone], root: &Cube, options: &HullOptions) -> Coarse {
    let mut carving = Carving {
        cones,
        tolerated: options.tolerated,
        kept: Vec::new(),
        kept_by_others: vec![Vec::new(); cones.len()],
        bounds: None,
    };
    let cell = COARSE_M.max(options.cell_m).max(root.half / MOST_CELLS_A_SIDE);
    carving.carve(*root, cell / 2.0);
    let volume = |cubes: &[Cube]| cubes.iter().map(|cube| (2.0 * cube.half).powi(3)).sum::<f64>();
    let kept = volume(&carving.kept);
    let alone: Vec<_> = carving.kept_by_others.iter().map(|cubes| volume(cubes)).collect();
    let largest = alone.iter().fold(1e-12, |most: f64, alone| most.max(kept + alone));
    let (unexplained, filled) = carving.fill_silhouettes();
    let agreement = |index: usize| Agreement {
        carved_alone: alone[index] / largest,
        unexplained: unexplained[index],
        filled: filled[index],
        is_left_out: false,
    };
    let agreement = (0..cones.len()).map(agreement).collect();
    let worst = (0..cones.len()).max_by(|&a, &b| unexplained[a].total_cmp(&unexplained[b]));
    let worst = worst.filter(|&worst| unexplained[worst] > DISAGREES);
    Coarse { agreement, worst, bounds: carving.bounds }
}

impl Carving<'_> {
    fn carve(&mut self, cube: Cube, smallest: f64) {
        let (mut outside, mut last_outside, mut inside) = (0, 0, 0);
        for (index, cone) in self.cones.iter().enumerate() {
            match cone.judge(&cube.centre, cube.half * 3f64.sqrt()) {
                Verdict::Outside => (outside, last_outside) = (outside + 1, index),
                Verdict::Inside => inside += 1,
                Verdict::Mixed => {}
            }
        }
        // cells that all but one see tell how views agree, whatever is tolerated
        if outside > self.tolerated.max(1) {
            return;
        }
        let is_whole = inside + outside == self.cones.len();
        if is_whole || cube.half <= smallest {
            if outside <= self.tolerated {
                let corner = Vector3::repeat(cube.half);
                let [least, most] = [cube.centre - corner, cube.centre + corner];
                let bounds = self.bounds.unwrap_or([least, most]);
                self.bounds = Some([bounds[0].inf(&least), bounds[1].sup(&most)]);
            }
            if !is_whole {
                let is_outside = |cone: &&Cone| cone.inside_m(&cube.centre) < 0.0;
                outside = self.cones.iter().filter(is_outside).count();
                last_outside = self.cones.iter().position(|cone| is_outside(&cone)).unwrap_or_default();
            }
            match outside {
                0 => self.kept.push(cube),
                1 => self.kept_by_others[last_outside].push(cube),
                _ => {}
            }
            return;
        }
        let half = cube.half / 2.0;
        for octant in 0..8 {
            let side = |axis: usize| if octant >> axis & 1 == 1 { half } else { -half };
            let centre = cube.centre + Vector3::new(side(0), side(1), side(2));
            self.carve(Cube { centre, half }, smallest);
        }
    }

    /// Of every cone: how much more of another silhouette the hull would fill without it, the largest share; and the share of
    /// its own silhouette that the hull fills.
    fn fill_silhouettes(&self) -> (Vec<f64>, Vec<f64>) {
        let mut shares = vec![0.0f64; self.cones.len()];
        let mut own = vec![0.0; self.cones.len()];
        for (index, cone) in self.cones.iter().enumerate() {
            let mut filled = Silhouette::empty(cone.small.width(), cone.small.height());
            self.kept.iter().for_each(|cube| cone.fill_small(cube, &mut filled));
            let area = cone.small.area().max(1) as f64;
            let words = cone.small.words().iter().zip(filled.words());
            own[index] = f64::from(words.map(|(seen, with)| (seen & with).count_ones()).sum::<u32>()) / area;
            for (other, cubes) in self.kept_by_others.iter().enumerate().filter(|(other, _)| *other != index)
            {
                let mut more = filled.clone();
                cubes.iter().for_each(|cube| cone.fill_small(cube, &mut more));
                let words = cone.small.words().iter().zip(filled.words().iter().zip(more.words()));
                let gained: u32 = words.map(|(seen, (with, more))| (seen & more & !with).count_ones()).sum();
                let share = f64::from(gained) / area;
                shares[other] = share.max(shares[other]);
            }
        }
        (shares, own)
    }
}
