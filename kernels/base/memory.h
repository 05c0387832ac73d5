#pragma once

namespace reliefbench {

/// Lets the process keep what it frees. Frames of megapixels are allocated anew for every case, and glibc gives blocks
/// of that size back to the kernel at once, so that every case pays for their pages again: at 1080p a fifth of what
/// judging costs. Before other threads start; elsewhere than on glibc it does nothing.
void keep_freed_memory();

}  // namespace reliefbench
