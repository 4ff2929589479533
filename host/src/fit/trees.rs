//! Boosted regression trees on histograms: a learner without physics, which says how much of a
//! series its inputs explain at all.
//!
//! Every input is cut into at most 64 bins of equally many rows. Each tree grows leaf by leaf,
//! always where a cut takes most of the squared error away, and follows what the trees before it
//! leave, by a part of it (Friedman, Annals of Statistics 29 (2001) 1189–1232).

/// The most bins per input.
const BINS: usize = 64;

/// How many trees, and how large.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Size {
    pub(crate) trees: usize,
    /// The most leaves of each tree.
    pub(crate) leaves: usize,
    /// Rows that a leaf holds at least.
    pub(crate) least_rows: usize,
    /// Part of what a leaf asks for that it adds.
    pub(crate) rate: f64,
}

/// What trees of moderate size need: more of either no longer lowers their error on other rows.
pub(crate) const SIZE: Size = Size {
    trees: 80,
    leaves: 24,
    least_rows: 20,
    rate: 0.12,
};

/// Inputs cut into bins, row by row.
pub(crate) struct Binned {
    /// Upper edges of each input's bins but the last.
    edges: Vec<Vec<f64>>,
    /// One series per input.
    bins: Vec<Vec<u8>>,
}

impl Binned {
    /// Cuts inputs, one series each, all equally long.
    pub(crate) fn new(inputs: &[Vec<f64>]) -> Self {
        let edges: Vec<Vec<f64>> = inputs.iter().map(|input| edges(input)).collect();
        let bins = inputs.iter().zip(&edges);
        let bins = bins.map(|(input, edges)| {
            let bin = |v: &f64| edges.partition_point(|edge| edge < v) as u8;
            input.iter().map(bin).collect()
        });
        Self {
            bins: bins.collect(),
            edges,
        }
    }
}

/// Edges between bins that hold equally many rows.
fn edges(input: &[f64]) -> Vec<f64> {
    let mut sorted = input.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = |bin: usize| sorted[bin * sorted.len() / BINS];
    let mut edges: Vec<f64> = if sorted.is_empty() {
        Vec::new()
    } else {
        (1..BINS).map(at).collect()
    };
    edges.dedup();
    edges
}

/// A node: a cut, or what its rows are given.
#[derive(Clone, Copy)]
struct Node {
    input: usize,
    bin: u8,
    /// The node of rows up to the cut; the one beyond it follows.
    left: usize,
    value: f64,
}

/// Rows of one leaf, and the cut that takes most away.
struct Leaf {
    node: usize,
    rows: Vec<u32>,
    /// Sum and count of every bin of every input.
    sums: Vec<[f64; 2]>,
    cut: Option<(f64, usize, u8)>,
}

/// Trees that were taught.
pub(crate) struct Trees {
    mean: f64,
    trees: Vec<Vec<Node>>,
}

impl Trees {
    /// Teaches trees what the `rows` of a series have to do with the inputs.
    pub(crate) fn teach(inputs: &Binned, target: &[f64], rows: &[u32], size: Size) -> Self {
        let count = rows.len().max(1) as f64;
        let mean = rows.iter().map(|&r| target[r as usize]).sum::<f64>() / count;
        let mut left: Vec<f64> = target.iter().map(|t| t - mean).collect();
        let mut trees = Vec::with_capacity(size.trees);
        for _ in 0..size.trees {
            let tree = grow(inputs, &mut left, rows, size);
            if tree.len() == 1 {
                break;
            }
            trees.push(tree);
        }
        Self { mean, trees }
    }

    /// What they say of a row.
    pub(crate) fn at(&self, inputs: &Binned, row: usize) -> f64 {
        let of = |tree: &Vec<Node>| {
            let mut node = tree[0];
            while node.left > 0 {
                let beyond = inputs.bins[node.input][row] > node.bin;
                node = tree[node.left + usize::from(beyond)];
            }
            node.value
        };
        self.mean + self.trees.iter().map(of).sum::<f64>()
    }
}

/// One tree; what it says is taken from `left`.
fn grow(inputs: &Binned, left: &mut [f64], rows: &[u32], size: Size) -> Vec<Node> {
    let nothing = Node {
        input: 0,
        bin: 0,
        left: 0,
        value: 0.0,
    };
    let mut nodes = vec![nothing];
    let sums = histogram(inputs, left, rows);
    let mut leaves = vec![Leaf {
        node: 0,
        rows: rows.to_vec(),
        cut: best_cut(inputs, &sums, size),
        sums,
    }];
    while leaves.len() < size.leaves {
        let gains = leaves.iter().enumerate();
        let gains = gains.filter_map(|(at, leaf)| leaf.cut.map(|(gain, ..)| (at, gain)));
        let Some((at, _)) = gains.max_by(|a, b| a.1.total_cmp(&b.1)) else {
            break;
        };
        let leaf = leaves.swap_remove(at);
        let Some((_, input, bin)) = leaf.cut else {
            break;
        };
        let series = &inputs.bins[input];
        let (low, high): (Vec<u32>, Vec<u32>) =
            leaf.rows.iter().partition(|&&r| series[r as usize] <= bin);
        nodes[leaf.node] = Node {
            input,
            bin,
            left: nodes.len(),
            value: 0.0,
        };
        // The sums of the larger part are what the smaller one leaves.
        let fewer = if low.len() < high.len() { &low } else { &high };
        let own = histogram(inputs, left, fewer);
        let pairs = leaf.sums.iter().zip(&own);
        let others: Vec<[f64; 2]> = pairs.map(|(a, b)| [a[0] - b[0], a[1] - b[1]]).collect();
        let (first, second) = if low.len() < high.len() {
            (own, others)
        } else {
            (others, own)
        };
        for (rows, sums) in [(low, first), (high, second)] {
            leaves.push(Leaf {
                node: nodes.len(),
                rows,
                cut: best_cut(inputs, &sums, size),
                sums,
            });
            nodes.push(nothing);
        }
    }
    for leaf in leaves {
        let sum: f64 = leaf.rows.iter().map(|&r| left[r as usize]).sum();
        let value = size.rate * sum / leaf.rows.len().max(1) as f64;
        nodes[leaf.node].value = value;
        for row in leaf.rows {
            left[row as usize] -= value;
        }
    }
    nodes
}

/// Sum and count of the rows in every bin of every input.
fn histogram(inputs: &Binned, left: &[f64], rows: &[u32]) -> Vec<[f64; 2]> {
    let mut sums = vec![[0.0; 2]; inputs.bins.len() * BINS];
    for (series, sums) in inputs.bins.iter().zip(sums.chunks_exact_mut(BINS)) {
        for &row in rows {
            let bin = &mut sums[usize::from(series[row as usize])];
            bin[0] += left[row as usize];
            bin[1] += 1.0;
        }
    }
    sums
}

/// The cut that takes most of the squared error away: what it takes, the input, and the last bin
/// before it.
fn best_cut(inputs: &Binned, sums: &[[f64; 2]], size: Size) -> Option<(f64, usize, u8)> {
    let least = size.least_rows as f64;
    let mut best: Option<(f64, usize, u8)> = None;
    for (input, sums) in sums.chunks_exact(BINS).enumerate() {
        let [whole, count] = sums
            .iter()
            .fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
        let (mut sum, mut rows) = (0.0, 0.0);
        for (bin, of_bin) in sums.iter().enumerate().take(inputs.edges[input].len()) {
            sum += of_bin[0];
            rows += of_bin[1];
            if rows < least || count - rows < least {
                continue;
            }
            let rest = whole - sum;
            let gain = sum * sum / rows + rest * rest / (count - rows) - whole * whole / count;
            if gain > best.map_or(1e-12 * (1.0 + whole.abs()), |best| best.0) {
                best = Some((gain, input, bin as u8));
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::{Binned, SIZE, Trees};
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn they_follow_what_their_inputs_say_and_nothing_else() {
        let mut rng = StdRng::seed_from_u64(3);
        let rows = 6000;
        let inputs: Vec<Vec<f64>> = (0..3)
            .map(|_| (0..rows).map(|_| rng.random_range(-1.0..1.0)).collect())
            .collect();
        let noise: Vec<f64> = (0..rows).map(|_| rng.random_range(-0.1..0.1)).collect();
        let law = |row: usize| inputs[0][row] * inputs[1][row].abs() + inputs[0][row].powi(2);
        let binned = Binned::new(&inputs);
        let taught: Vec<u32> = (0..rows as u32 / 2).collect();
        let left = |target: &[f64]| {
            let trees = Trees::teach(&binned, target, &taught, SIZE);
            let judged = rows / 2..rows;
            let square = |errors: &mut dyn Iterator<Item = f64>| errors.map(|e| e * e).sum::<f64>();
            let before = square(&mut judged.clone().map(|row| target[row]));
            square(&mut judged.map(|row| target[row] - trees.at(&binned, row))) / before
        };
        let target: Vec<f64> = (0..rows).map(|row| law(row) + noise[row]).collect();
        let (followed, chance) = (left(&target), left(&noise));
        println!("left of a law {followed:.4}, of noise {chance:.4}");
        assert!(followed < 0.05, "{followed}");
        assert!(chance > 0.98, "{chance}");
    }
}
