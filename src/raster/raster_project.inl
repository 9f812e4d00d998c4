/* raster_project.inl: vertices through the matrix, a vector at a time. Part of raster_kernels.inl.
 * The arithmetic is vd_vertices_run's and vd_project's, operation by operation. */

static void project(const vd_drawing *drawing, uint32_t first, uint32_t count) {
    if (drawing->shader->vertex != NULL) {
        vd_project_reference(drawing, first, count);
        return;
    }
    const float(*m)[4] = drawing->view.picture_from_mesh;
    const float *px = vd_mesh_positions(drawing->mesh, 0);
    const float *py = vd_mesh_positions(drawing->mesh, 1);
    const float *pz = vd_mesh_positions(drawing->mesh, 2);
    const float half_width = 0.5f * (float)drawing->view.width;
    const float half_height = 0.5f * (float)drawing->view.height;
    const vd_wide_f32 guard = vd_wide_splat_f32((float)VD_GUARD_PIXELS);
    const vd_wide_f32 near = vd_wide_splat_f32(drawing->depth_near);
    const vd_wide_f32 far = vd_wide_splat_f32(drawing->depth_far);
    const vd_wide_f32 zero = vd_wide_splat_f32(0.0f);
    for (uint32_t i = first; i < first + count; i += VD_WIDE_LANES) {
        const vd_wide_f32 x = vd_wide_load_f32(px + i), y = vd_wide_load_f32(py + i);
        const vd_wide_f32 z = vd_wide_load_f32(pz + i);
        vd_wide_f32 p[4];
        for (int r = 0; r < 4; r++) {
            p[r] = m[r][0] * x + (m[r][1] * y + (m[r][2] * z + m[r][3]));
        }
        const vd_wide_f32 rw = 1.0f / p[3];
        const vd_wide_f32 at_x = p[0] * rw, at_y = p[1] * rw, depth = p[2] * rw;
        const vd_wide_f32 from_x = at_x - half_width, from_y = at_y - half_height;
        const vd_wide_f32 far_x = vd_wide_max_f32(from_x, zero - from_x);
        const vd_wide_f32 far_y = vd_wide_max_f32(from_y, zero - from_y);
        /* What lies exactly on a border, or is not a number, goes the plain way. */
        vd_wide_mask inside = vd_wide_less_f32(zero, p[3]);
        inside = vd_wide_and(inside, vd_wide_less_f32(depth, near));
        inside = vd_wide_and(inside, vd_wide_less_f32(far, depth));
        inside = vd_wide_and(inside, vd_wide_less_f32(far_x, guard));
        inside = vd_wide_and(inside, vd_wide_less_f32(far_y, guard));
        const vd_wide_i32 record[4] = {vd_wide_to_i32(vd_wide_floor_f32(at_x * 256.0f - 127.5f)),
                                       vd_wide_to_i32(vd_wide_floor_f32(at_y * 256.0f - 127.5f)),
                                       (vd_wide_i32)depth, (vd_wide_i32)rw};
        vd_wide_store_records(drawing->vertices + i, record);
        uint32_t outside = ~vd_wide_bits(inside) & ALL_LANES;
        for (; outside != 0; outside &= outside - 1) {
            const int lane = __builtin_ctz(outside);
            const float one[4] = {p[0][lane], p[1][lane], p[2][lane], p[3][lane]};
            drawing->vertices[i + (uint32_t)lane] = vd_project(drawing, one);
        }
    }
}
