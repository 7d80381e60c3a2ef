// The log goes nowhere, but each line must be one object of one line, whatever peers call
// themselves.
#pragma once

namespace atlas::fuzz {

// Before any thread logs.
void UseStrictLog();

}  // namespace atlas::fuzz
