//! The inner loops of a sample in assembly, for a Cortex-M4 or M7: the bits of
//! `jointwatch_shared::base::kernels` in fewer instructions.
//!
//! They load four words with one instruction, which also moves on to the next four; the compiler
//! pairs two at most, and computes addresses besides. What runs is the same for all values: no
//! branch depends on one.

use core::arch::naked_asm;
use jointwatch_shared::base::kernels;
use jointwatch_shared::base::network::Neuron;
use jointwatch_shared::base::polynomial::{BLOCKS, Block, Blocks};
use jointwatch_shared::base::tanh::{LAST, Row, TABLE};

/// The loops in assembly, for a processor with the instructions of Armv7E-M.
#[derive(Clone, Copy, Debug)]
pub struct Assembly;

impl kernels::Kernels for Assembly {
    #[inline(always)]
    fn products(weights: &[i32], rows: &[[i32; 2]]) -> [i64; 2] {
        let count = weights.len().min(rows.len());
        let mut sums = [0; 2];
        // SAFETY: both slices have `count` elements at least, and `sums` is there to be written.
        unsafe { products(weights.as_ptr(), rows.as_ptr(), count, &mut sums) };
        sums
    }

    #[inline(always)]
    fn sum_of_blocks(
        blocks: &Blocks,
        outer: &[i32; BLOCKS],
        row: &[i32; 3],
        column: &[i32; 3],
    ) -> i64 {
        // SAFETY: all four are there to be read, for as long as the function says.
        unsafe { sum_of_blocks(blocks, outer, row, column) }
    }

    #[inline(always)]
    fn sum_of_neurons<const AXES: usize>(
        neurons: &[Neuron],
        mut sums: [i64; 2],
        u: &[i32; 4],
    ) -> [i64; 2] {
        if !neurons.is_empty() {
            // SAFETY: there are as many neurons as it is told, and every step of a table from 0 to
            // `LAST` is in it.
            unsafe { sum_of_neurons(neurons.as_ptr(), neurons.len(), u, &TABLE, &mut sums) };
        }
        sums
    }
}

/// Eight weights and rows in [`products`].
macro_rules! eight_products {
    () => {
        concat!(
            ".rept 2\n",
            "ldm r0!, {{r2, r3, r4, r5}}\n",
            "ldm r1!, {{r6, r7, r12, lr}}\n",
            "smlal r8, r9, r2, r6\n",
            "smlal r10, r11, r2, r7\n",
            "smlal r8, r9, r3, r12\n",
            "smlal r10, r11, r3, lr\n",
            "ldm r1!, {{r6, r7, r12, lr}}\n",
            "smlal r8, r9, r4, r6\n",
            "smlal r10, r11, r4, r7\n",
            "smlal r8, r9, r5, r12\n",
            "smlal r10, r11, r5, lr\n",
            ".endr\n",
        )
    };
}

/// r0 weights, r1 rows, r2 count, r3 where both sums go.
///
/// # Safety
/// `weights` and `rows` have `count` elements, `sums` can be written.
#[unsafe(naked)]
unsafe extern "C" fn products(
    weights: *const i32,
    rows: *const [i32; 2],
    count: usize,
    sums: *mut [i64; 2],
) {
    naked_asm!(
        "push {{r2, r3, r4, r5, r6, r7, r8, r9, r10, r11, r12, lr}}",
        // r8:r9 and r10:r11 are the sums, all others from r2 on for what is loaded.
        "movs r8, #0",
        "movs r9, #0",
        "movs r10, #0",
        "movs r11, #0",
        // Above the count and the sums' place: where the last eight weights begin.
        "bics r3, r2, #7",
        "beq 2f",
        "add r3, r0, r3, lsl #2",
        "push {{r3}}",
        // Sixteen at a time, of an odd number of eights the first one alone.
        "tst r2, #8",
        "bne 5f",
        "1:",
        eight_products!(),
        "5:",
        eight_products!(),
        "ldr r2, [sp]",
        "cmp r0, r2",
        "bne 1b",
        "add sp, #4",
        "2:",
        "pop {{r2, r3}}",
        // Fewer than eight are left.
        "ands r2, r2, #7",
        "beq 4f",
        "3:",
        "ldr r4, [r0], #4",
        "ldm r1!, {{r5, r6}}",
        "smlal r8, r9, r4, r5",
        "smlal r10, r11, r4, r6",
        "subs r2, #1",
        "bne 3b",
        "4:",
        "stm r3, {{r8, r9, r10, r11}}",
        "pop {{r4, r5, r6, r7, r8, r9, r10, r11, r12, pc}}",
    )
}

/// What a block is to the loop: sixteen words, the gain, and a word that nothing is in.
const _: () = assert!(size_of::<Block>() == 72 && core::mem::offset_of!(Block, gain) == 64);

/// r0 blocks, r1 monomials, r2 powers of the last but one input, r3 powers of the last one; the sum
/// in r0 and r1.
///
/// # Safety
/// All four can be read.
#[unsafe(naked)]
unsafe extern "C" fn sum_of_blocks(
    blocks: *const Blocks,
    outer: *const [i32; BLOCKS],
    row: *const [i32; 3],
    column: *const [i32; 3],
) -> i64 {
    naked_asm!(
        "push {{r4, r5, r6, r7, r8, r9, r10, r11, r12, lr}}",
        // The monomials onto the stack, from which each is taken once, and above them what is
        // none: it ends the loop.
        "mov r4, #0x80000000",
        "push {{r4, r5}}",
        "add r1, #32",
        "ldm r1, {{r4, r5, r6, r7, r8, r9, r10, r11}}",
        "push {{r4, r5, r6, r7, r8, r9, r10, r11}}",
        "sub r1, #32",
        "ldm r1, {{r4, r5, r6, r7, r8, r9, r10, r11}}",
        "push {{r4, r5, r6, r7, r8, r9, r10, r11}}",
        // r5 to r7 powers of the rows, r2 to r4 powers within a row, r8:r9 the sum.
        "ldm r2, {{r5, r6, r7}}",
        "ldm r3, {{r2, r3, r4}}",
        "movs r8, #0",
        "movs r9, #0",
        "1:",
        ".rept 2",
        "ldm r0!, {{r10, r11, r12, lr}}",
        "smmlar r10, r11, r2, r10",
        "smmlar r10, r12, r3, r10",
        "smmlar r10, lr, r4, r10",
        "ldm r0!, {{r1, r11, r12, lr}}",
        "smmlar r1, r11, r2, r1",
        "smmlar r1, r12, r3, r1",
        "smmlar r1, lr, r4, r1",
        "smmlar r10, r1, r5, r10",
        "ldm r0!, {{r1, r11, r12, lr}}",
        "smmlar r1, r11, r2, r1",
        "smmlar r1, r12, r3, r1",
        "smmlar r1, lr, r4, r1",
        "smmlar r10, r1, r6, r10",
        "ldm r0!, {{r1, r11, r12, lr}}",
        "smmlar r1, r11, r2, r1",
        "smmlar r1, r12, r3, r1",
        "smmlar r1, lr, r4, r1",
        "smmlar r10, r1, r7, r10",
        "ldr r11, [r0], #8",
        "pop {{r12}}",
        "smmulr r11, r12, r11",
        "smlal r8, r9, r10, r11",
        ".endr",
        "ldr r12, [sp]",
        "cmp r12, #0x80000000",
        "bne 1b",
        "mov r0, r8",
        "mov r1, r9",
        "add sp, #8",
        "pop {{r4, r5, r6, r7, r8, r9, r10, r11, r12, pc}}",
    )
}

/// What a neuron is to the loop: weights, outputs, bias, steps, and a word that nothing is in.
const _: () = assert!(
    size_of::<Neuron>() == 40
        && core::mem::offset_of!(Neuron, outputs) == 16
        && core::mem::offset_of!(Neuron, bias) == 24
        && core::mem::offset_of!(Neuron, steps) == 32
);

/// r0 neurons, r1 how many, r2 inputs, r3 the table of tanh; on the stack where the sums are, to
/// which it adds.
///
/// # Safety
/// There are `count` neurons, one at least; the others can be read, and `sums` written.
#[unsafe(naked)]
unsafe extern "C" fn sum_of_neurons(
    neurons: *const Neuron,
    count: usize,
    u: *const [i32; 4],
    table: *const [Row; LAST as usize + 1],
    sums: *mut [i64; 2],
) {
    naked_asm!(
        "push {{r4, r5, r6, r7, r8, r9, r10, r11, r12, lr}}",
        "ldr r12, [sp, #40]",
        "ldm r12, {{r8, r9, r10, r11}}",
        // On the stack: the inputs, the table, where the sums are.
        "push {{r3, r12}}",
        "ldm r2, {{r4, r5, r6, r7}}",
        "push {{r4, r5, r6, r7}}",
        "1:",
        // The argument in r3:r4, of which the high word counts.
        "ldrd r3, r4, [r0, #24]",
        "ldm r0!, {{r5, r6, r7, r12}}",
        "ldrd r2, lr, [sp]",
        "smlal r3, r4, r5, r2",
        "smlal r3, r4, r6, lr",
        "ldrd r2, lr, [sp, #8]",
        "smlal r3, r4, r7, r2",
        "smlal r3, r4, r12, lr",
        // Its sign in r5, its size in steps in r4 and 2⁻³² of one in r3; the nearest node in r4.
        "ldr r6, [r0, #16]",
        "asr r5, r4, #31",
        "eor r4, r4, r5",
        "sub r4, r4, r5",
        "umull r3, r4, r4, r6",
        "add r4, r4, r3, lsr #31",
        "cmp r4, #{last}",
        "it hi",
        "movhi r4, #{last}",
        // (c₀ + c₁·s) + s²·(c₂ + c₃·s)
        "ldr r2, [sp, #16]",
        "add r4, r2, r4, lsl #4",
        "ldm r4, {{r2, r4, r6, lr}}",
        "smmlar r6, r3, lr, r6",
        "smmulr lr, r3, r3",
        "smmlar r2, r3, r4, r2",
        "smmlar r2, r6, lr, r2",
        "eor r2, r2, r5",
        "sub r2, r2, r5",
        "ldrd r7, r12, [r0], #24",
        "smlal r8, r9, r7, r2",
        "smlal r10, r11, r12, r2",
        "subs r1, #1",
        "bne 1b",
        "add sp, #16",
        "pop {{r3, r12}}",
        "stm r12, {{r8, r9, r10, r11}}",
        "pop {{r4, r5, r6, r7, r8, r9, r10, r11, r12, pc}}",
        last = const LAST,
    )
}
