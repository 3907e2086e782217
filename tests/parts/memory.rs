//! The most memory that a thread holds.
// Counting what is allocated needs an allocator, and `GlobalAlloc` is an unsafe trait. This one hands every call on to the
// system's allocator unchanged and counts beside it, so that it keeps the trait's contract exactly where the system's does.
#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System as Heap};
use std::cell::Cell;

struct Counting;

thread_local! {
    /// Bytes that this thread holds, and the most that it held.
    static HELD: Cell<(usize, usize)> = const { Cell::new((0, 0)) };
}

fn count(change: impl Fn(usize) -> usize) {
    // Threads that end no longer count.
    let _ = HELD.try_with(|held| {
        let now = change(held.get().0);
        held.set((now, held.get().1.max(now)));
    });
}

unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(|held| held.wrapping_add(layout.size()));
        unsafe { Heap.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count(|held| held.saturating_sub(layout.size()));
        unsafe { Heap.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count(|held| held.saturating_sub(layout.size()).wrapping_add(size));
        unsafe { Heap.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// The most bytes that `f` held at a time.
pub fn peak<T>(f: impl FnOnce() -> T) -> (usize, T) {
    HELD.with(|held| held.set((0, 0)));
    let result = f();
    (HELD.with(|held| held.get().1), result)
}
