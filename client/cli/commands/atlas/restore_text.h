// What a restore came to: as text and as JSON.
#pragma once

#include "client/atlas_file/backup_restore.h"
#include "client/cli/command_line/command.h"

namespace atlas {

// `kept` of the JSON names the database that was there, else what was left of one; empty: nothing.
void PrintRestore(const RestoreSummary& done, const CommandContext& context);

}  // namespace atlas
