/* component/state.py: the state of an instance, copied, and as bytes for another process.

   Bytes have a name that changes with the layout, every value, and a checksum; contacts are made again
   from their initial states. Bytes of another version, cut or damaged ones, are refused; forged ones with
   a right checksum are the host's own business. */

static const char LAYOUT[] = "golf-impact native state 6";

enum {
    STATE_SIZE = offsetof(Snapshot, impact.contact),
    PACKED_SIZE = sizeof LAYOUT + STATE_SIZE + sizeof(uint64_t)
};

static uint64_t checksum(const unsigned char bytes[], size_t size)
{
    uint64_t sum = UINT64_C(14695981039346656037); /* FNV-1a */
    for (size_t n = 0; n < size; n++) sum = (sum ^ bytes[n]) * UINT64_C(1099511628211);
    return sum;
}

/* Write a state as `PACKED_SIZE` bytes. */
static void packed(const Snapshot *from, unsigned char bytes[])
{
    memcpy(bytes, LAYOUT, sizeof LAYOUT);
    memcpy(bytes + sizeof LAYOUT, from, STATE_SIZE);
    uint64_t sum = checksum(bytes, sizeof LAYOUT + STATE_SIZE);
    memcpy(bytes + sizeof LAYOUT + STATE_SIZE, &sum, sizeof sum);
}

/* READING */

/* Read a state from bytes; returns whether they are one of this version's. */
static int unpacked(Snapshot *to, const unsigned char bytes[], size_t size)
{
    uint64_t sum;
    memset(to, 0, sizeof *to);
    if (size != PACKED_SIZE || memcmp(bytes, LAYOUT, sizeof LAYOUT)) return 0;
    memcpy(&sum, bytes + size - sizeof sum, sizeof sum);
    if (sum != checksum(bytes, size - sizeof sum)) return 0;
    memcpy(to, bytes + sizeof LAYOUT, STATE_SIZE);
    if (to->has_impact && !to->is_solved && to->impact.phase != APPROACH)
        contact_begin(&to->impact.contact, &to->parameters, to->impact.acting, to->impact.motion);
    return 1;
}

/* COPIES */

static void snapshot_copy(Snapshot *to, const Snapshot *from)
{
    memcpy(to, from, offsetof(Snapshot, impact));
    impact_copy(&to->impact, &from->impact);
}

/* Go back to a state: the instance is then exactly as it was. */
static void component_restore(Component *c, const Snapshot *from)
{
    snapshot_copy(&c->is, from);
    c->has_state = 0;
    c->point_is_free = 1;
    c->size = NAN;
}
