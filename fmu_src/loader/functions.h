/* The functions that FMI 2.0 and 3.0 have in common. The including file defines their names,
   FMI(name), and with COUNT the last argument of the functions of values. */

#define Status FMI(Status)
#define QUOTED(name) QUOTED_(name)
#define QUOTED_(name) #name

/* The body of a function: the statement is true if all is well. */
#define IN_PYTHON(...)                                                                             \
    do {                                                                                           \
        Instance *i = c;                                                                           \
        if (!i) return FMI(Error);                                                                 \
        Entry entry = enter();                                                                     \
        int fine = (__VA_ARGS__);                                                                  \
        int raised = flush(i);                                                                     \
        leave(entry);                                                                              \
        return raised ? (Status)raised : fine ? FMI(OK) : FMI(Error);                              \
    } while (0)

void FMI(FreeInstance)(void *c) { free_instance(c); }

Status FMI(SetDebugLogging)(void *c, FMI(Boolean) on, size_t count, const char *const names[])
{
    if (!c) return FMI(Error);
    set_logging(c, on, count, names);
    return FMI(OK);
}

/* The slave returns whether the start values can be used. */
Status FMI(ExitInitializationMode)(void *c)
{
    int accepted = 0;
    IN_PYTHON(TAKE(call(i, "exit_initialization_mode", NULL, NULL),
                   accepted = PyObject_IsTrue(found)) && accepted);
}

Status FMI(Terminate)(void *c) { IN_PYTHON(simple(i, "terminate", NULL, NULL)); }
Status FMI(Reset)(void *c) { IN_PYTHON(new_slave(i)); }

/* Values. ACCESS makes the functions of one type: how Python names it, and how an item becomes a
   value, and a value an item. */

#define ACCESS(Name, name, to_c, to_python)                                                        \
    Status FMI(Get##Name)(void *c, const uint32_t references[], size_t count,                      \
                          FMI(Name) values[] COUNT)                                                \
    {                                                                                              \
        IN_PYTHON(READ(call(i, "get_" name, reference_list(references, count), NULL), count,       \
                       values, (FMI(Name))to_c(item)));                                            \
    }                                                                                              \
    Status FMI(Set##Name)(void *c, const uint32_t references[], size_t count,                      \
                          const FMI(Name) values[] COUNT)                                          \
    {                                                                                              \
        IN_PYTHON(simple(i, "set_" name, reference_list(references, count),                        \
                         LIST(count, to_python(values[n]))));                                      \
    }
ACCESS(Boolean, "boolean", PyObject_IsTrue, PyBool_FromLong)

/* Strings live until the next ones are read. */
Status FMI(GetString)(void *c, const uint32_t references[], size_t count, const char *values[] COUNT)
{
    IN_PYTHON(TAKE(call(i, "get_string", reference_list(references, count), NULL), {
        Py_DecRef(i->strings);
        Py_IncRef(i->strings = found);
        for (size_t n = 0; n < count; n++) {
            Object *item = PyList_GetItem(found, (intptr_t)n);
            values[n] = item ? PyUnicode_AsUTF8AndSize(item, NULL) : NULL;
        }
    }));
}

Status FMI(SetString)(void *c, const uint32_t references[], size_t count,
                      const char *const values[] COUNT)
{
    IN_PYTHON(simple(i, "set_string", reference_list(references, count),
                     LIST(count, PyUnicode_FromString(values[n]))));
}

/* State */

Status FMI(GetFMUState)(void *c, void **state)
{
    int kept = 0;
    IN_PYTHON(TAKE(call(i, "_get_fmu_state", NULL, NULL), kept = keep_state(i, found, state)) &&
              kept);
}

Status FMI(SetFMUState)(void *c, void *state)
{
    IN_PYTHON(TAKE(of_state(i, "_set_fmu_state", state), (void)0));
}

Status FMI(FreeFMUState)(void *c, void **state)
{
    IN_PYTHON((free_state(state), 1));
}

Status FMI(SerializedFMUStateSize)(void *c, void *state, size_t *size)
{
    IN_PYTHON(TAKE(of_state(i, "_fmu_state_to_bytes", state), *size = (size_t)PyBytes_Size(found)));
}

Status FMI(SerializeFMUState)(void *c, void *state, FMI(Byte) data[], size_t size)
{
    IN_PYTHON(TAKE(of_state(i, "_fmu_state_to_bytes", state), {
        size_t length = (size_t)PyBytes_Size(found);
        memcpy(data, PyBytes_AsString(found), length < size ? length : size);
    }));
}

Status FMI(DeserializeFMUState)(void *c, const FMI(Byte) data[], size_t size, void **state)
{
    Object *bytes;
    int kept = 0;
    IN_PYTHON(bytes = PyBytes_FromStringAndSize((const char *)data, (intptr_t)size),
              TAKE(call(i, "_fmu_state_from_bytes", bytes, NULL),
                   kept = keep_state(i, found, state)) && kept);
}

/* For functions that the slave doesn't have. Their arguments don't matter. */
#define UNSUPPORTED(name)                                                                          \
    Status FMI(name)(void *c)                                                                      \
    {                                                                                              \
        if (c)                                                                                     \
            log_message(c, FMI(Error), "logStatusError", QUOTED(FMI(name)) " isn't supported");    \
        return FMI(Error);                                                                         \
    }
