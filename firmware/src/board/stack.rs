//! How much of the stack was ever used: it is painted at the start, and where the paint has gone,
//! somebody was.

/// What untouched words hold.
const PAINT: u32 = 0x5AFE_57AC;
/// Bytes right below the painter's own frame that are left alone.
const OWN_FRAME: usize = 256;

unsafe extern "C" {
    // Addresses and a size from the board's memory map; there is nothing of Rust's behind them.
    static _stack_start: u32;
    static _stack_reserved: u8;
    static __sdata: u8;
    static __edata: u8;
    static __sbss: u8;
    static __sheap: u8;
}

/// Bytes that are reserved for the stack.
pub fn reserved() -> usize {
    &raw const _stack_reserved as usize
}

/// Bytes of RAM that variables take, besides the stack.
pub fn variables() -> usize {
    let at = |symbol: *const u8| symbol as usize;
    let data = at(&raw const __edata).wrapping_sub(at(&raw const __sdata));
    data.wrapping_add(at(&raw const __sheap).wrapping_sub(at(&raw const __sbss)))
}

fn words() -> impl Iterator<Item = *mut u32> {
    let top = &raw const _stack_start as usize;
    (top.wrapping_sub(reserved())..top)
        .step_by(4)
        .map(|at| at as *mut u32)
}

/// Paints what is reserved and not in use yet.
pub fn paint() {
    let here = cortex_m::register::msp::read() as usize;
    for word in words().take_while(|&word| (word as usize) < here.wrapping_sub(OWN_FRAME)) {
        // SAFETY: RAM between the variables and the stack's end, which nothing uses yet.
        unsafe { word.write_volatile(PAINT) };
    }
}

/// The most bytes that were in use since [`paint`]; all that are reserved when it was that or more.
pub fn peak() -> usize {
    // SAFETY: reading RAM that is there.
    let untouched = words().take_while(|&word| unsafe { word.read_volatile() } == PAINT);
    reserved().saturating_sub(4 * untouched.count())
}
