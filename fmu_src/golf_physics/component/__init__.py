"""One instance of the component, for any interface.

`component` steps, sets and reads; `outputs` is what each output is; `state` keeps and restores an
instance; `hybrid` adds Model Exchange, which only FMI 3.0 has.
"""
