#pragma once
// The working directory of this process and the mask of new files' rights, which a library may change as it likes: what
// is written afterwards by a relative name must not land where it leads.

namespace graze {

/// Remembers both as they are now, if it is the first call; before libraries are loaded. Programs whose caller may
/// change them on purpose, such as an interpreter, leave it out.
void keep_place();
/// Puts both back as they were then; nothing if they were not kept. From any thread: what it puts back is the same for
/// all of them, wherever a library that runs in another one has gone meanwhile.
void put_place_back() noexcept;

}  // namespace graze
