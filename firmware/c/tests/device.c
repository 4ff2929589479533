// The library on QEMU's netduinoplus2: the digests of two rigs, what a sample takes, and how much stack was used.
//
// Model and rig blocks are put into flash by QEMU's loader. Text and exit code go out by semihosting.
#include "motion.h"

#define MODEL ((const uint8_t *)0x080C0000u)
#define RIG (MODEL + JW_BLOB_LENGTH)
#define WATCHED_RIG (RIG + JW_BLOB_LENGTH)
#define CHAIN_SAMPLES 2000u
#define WATCHED_SAMPLES 5000u
// As the self-test counts (firmware/src/suite.rs).
#define SAMPLES_TO_FILL 400u
#define SAMPLES_COUNTED 1000u

// STM32F405: the clock of TIM5, and TIM5 itself (RM0090), which QEMU lets count instructions.
#define APB1ENR (*(volatile uint32_t *)0x40023840u)
#define TIM5(offset) (*(volatile uint32_t *)(0x40000C00u + (offset)))
#define COUNT TIM5(0x24u)

extern uint32_t stack_low, stack_top;
void reset(void);
void fault(void);
#define PAINT 0x5AFE57ACu

static int semihost(int operation, const void *argument) {
    register int r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

// Writes to the host's standard output, which has the name ":tt".
static void text(const char *words) {
    static int handle = 0;
    uint32_t length = 0;
    if (handle == 0) {
        const uintptr_t file[3] = {(uintptr_t) ":tt", 4, 3};
        handle = semihost(1, file);
    }
    while (words[length] != 0) {
        length++;
    }
    const uintptr_t piece[3] = {(uintptr_t)handle, (uintptr_t)words, length};
    (void)semihost(5, piece);
}

static void leave(int passed) {
    // ADP_Stopped_ApplicationExit, and the code of a run-time error.
    (void)semihost(0x18, (const void *)(passed ? 0x20026u : 0x20023u));
    for (;;) {
    }
}

static void hexadecimal(const char *what, uint64_t value) {
    char digits[18];
    for (unsigned n = 0; n < 16; n++) {
        digits[n] = "0123456789abcdef"[(value >> (60 - 4 * n)) & 15u];
    }
    digits[16] = '\n';
    digits[17] = 0;
    text(what);
    text(" ");
    text(digits);
}

static void count_samples(void) {
    struct motion motion = {SEED, {0}, {0}};
    uint32_t least = UINT32_MAX, most = 0;
    jw_chain *chain;
    jw_monitor *monitor = watch(MODEL, WATCHED_RIG, &chain);
    if (monitor == NULL) {
        leave(0);
    }
    uint32_t empty = COUNT;
    empty = COUNT - empty;
    for (uint32_t n = 0; n < SAMPLES_TO_FILL + SAMPLES_COUNTED; n++) {
        jw_counts counts = next_small_counts(&motion);
        jw_output output;
        jw_verdict verdict;
        uint32_t begun = COUNT;
        (void)jw_chain_step(chain, &counts, NULL, &output);
        (void)jw_monitor_step(monitor, &counts, &output, NULL, &verdict);
        uint32_t taken = COUNT - begun - empty;
        if (n >= SAMPLES_TO_FILL) {
            least = taken < least ? taken : least;
            most = taken > most ? taken : most;
        }
    }
    hexadecimal("least", least);
    hexadecimal("most", most);
}

static void run(void) {
    APB1ENR |= 1u << 3;
    (void)APB1ENR;
    TIM5(0x2Cu) = UINT32_MAX;
    TIM5(0x14u) = 1;
    TIM5(0x00u) = 1;
    hexadecimal("chain", chain_digest(MODEL, RIG, CHAIN_SAMPLES));
    hexadecimal("watched", watched_digest(MODEL, WATCHED_RIG, WATCHED_SAMPLES));
    count_samples();
    const uint32_t *unused = &stack_low;
    while (unused < &stack_top && *unused == PAINT) {
        unused++;
    }
    hexadecimal("stack", (uint64_t)(&stack_top - unused) * 4);
    leave(1);
}

void reset(void) {
    extern uint32_t data_start, data_end, data_load, bss_start, bss_end;
    // The library may use the floating-point unit (Armv7-M, CPACR).
    *(volatile uint32_t *)0xE000ED88u |= 0xFu << 20;
    __asm__ volatile("dsb\nisb" ::: "memory");
    uint32_t *from = &data_load;
    for (uint32_t *to = &data_start; to < &data_end; to++) {
        *to = *from++;
    }
    for (uint32_t *to = &bss_start; to < &bss_end; to++) {
        *to = 0;
    }
    uint32_t *here;
    __asm__ volatile("mov %0, sp" : "=r"(here));
    for (volatile uint32_t *word = &stack_low; word < here - 64; word++) {
        *word = PAINT;
    }
    run();
}

void fault(void) {
    text("fault\n");
    leave(0);
}

union vector {
    const void *stack;
    void (*handler)(void);
};

__attribute__((section(".vectors"), used)) static const union vector vectors[] = {
    {.stack = &stack_top},
    {.handler = reset},
    {.handler = fault},
    {.handler = fault},
    {.handler = fault},
    {.handler = fault},
    {.handler = fault},
};
