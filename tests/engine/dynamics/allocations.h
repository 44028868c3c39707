#pragma once
// How often operator new has been called in this program; 0 under sanitizers, which have their own.

namespace graze::testing {
long allocations();
}
