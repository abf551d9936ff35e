// The extension module, built once for each instruction set (CMakeLists.txt) under the name KERNELS_MODULE. Each subject
// has its own binding: it unpacks arrays, owns the workspace, releases the lock, and contains no logic.
#include "bind_cell_classes.hpp"
#include "bind_elementary.hpp"
#include "bind_global.hpp"
#include "bind_grid_search.hpp"
#include "bind_linear.hpp"
#include "bind_pose_field.hpp"
#include "bind_poses.hpp"
#include "bind_range_filter.hpp"
#include "bind_raster.hpp"
#include "bind_scip_blocks.hpp"
#include "bind_sight.hpp"
#include "bind_visibility.hpp"
#include "cpu.hpp"

NB_MODULE(KERNELS_MODULE, m) {
    m.def("simd_width", &eldorado::simd_width);
    eldorado::bind_elementary(m);
    eldorado::bind_linear(m);
    eldorado::bind_raster(m);
    eldorado::bind_range_filter(m);
    eldorado::bind_pose_field(m);
    eldorado::bind_visibility(m);
    eldorado::bind_global(m);
    eldorado::bind_grid_search(m);
    eldorado::bind_sight(m);
    eldorado::bind_cell_classes(m);
    eldorado::bind_poses(m);
    eldorado::bind_scip_blocks(m);
}
