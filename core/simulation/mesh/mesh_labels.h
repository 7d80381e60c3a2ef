// Labels for a mesh that came without: what one may drive on, and on which deck.
#pragma once

#include "core/simulation/mesh/triangle_mesh.h"

namespace atlas {

struct MeshLabelOptions {
  double max_slope_deg = 25.0;   // steeper is structure; the garage's ramps reach 18.5
  double level_slope_deg = 3.0;  // decks are found among what is this level
  double deck_gap_m = 2.0;       // levels further apart are two decks
  double min_deck_share = 0.02;  // of the level area; a lesser level is no deck
  double ramp_margin_m = 0.5;    // a deck reaches this far below its height
  double facing_up_share = 0.9;  // of the mesh seen from above, when its winding can be trusted
};

// Road where a triangle is flat enough and faces up, other structure elsewhere. Where the mesh's
// winding says nothing, i.e. what is seen from straight above does not face up, either side counts.
// The deck is that of the triangle's lowest corner: 0 below the second deck, and so on.
void LabelMesh(TriangleMesh& mesh, const MeshLabelOptions& options = {});

}  // namespace atlas
