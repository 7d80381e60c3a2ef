// What a batch of corrections, or its undoing, came to: as text and as JSON.
#pragma once

#include "client/cli/command_line/command.h"

namespace atlas {

void PrintPoseBatch(const PoseBatchSummary& batch, const CommandContext& context);

}  // namespace atlas
