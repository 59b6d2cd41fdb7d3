"""The figures of a results folder: what ``rightofway figures`` draws from records and logs."""
